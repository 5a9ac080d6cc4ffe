//! Figures as SVG that stands in a page: line charts and stacked bars.
//!
//! Responsible for: axes, scales, ticks and marks, drawn with plotters.
//! Not responsible for: which numbers are drawn (each benchmark) and the page around them
//! (`report`), which has the legend too.
//!
//! Text and axes take the page's own colour, so a figure reads on paper and in a dark browser.
//! The series' colours are those of M. Okabe and K. Ito, "Color universal design" (2008), which
//! people with any colour vision tell apart.

use plotters::coord::ranged1d::{KeyPointHint, NoDefaultFormatting, Ranged, ValueFormatter};
use plotters::prelude::*;

/// Width of a figure, pixels.
const WIDTH_PX: u32 = 760;
/// Height of a figure, pixels.
const HEIGHT_PX: u32 = 360;
/// Colours of the series, in their order.
const COLOURS: [RGBColor; 8] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(86, 180, 233),
    RGBColor(230, 159, 0),
    RGBColor(148, 103, 189),
    RGBColor(140, 140, 140),
];
/// Drawn in this colour, it becomes the page's own.
const INK: RGBColor = RGBColor(1, 2, 3);
const INK_HEX: &str = "#010203";
/// Grid lines, on light and dark alike.
const GRID: RGBAColor = RGBAColor(128, 128, 128, 0.25);
/// Labels on an axis, about.
const TICKS: f64 = 6.0;

/// A figure could not be drawn: a number on its axes is not finite, or there is none.
#[derive(Debug, thiserror::Error)]
#[error("the figure '{title}' could not be drawn: {reason}")]
pub struct FigureError {
    title: String,
    reason: String,
}

/// A figure for a page.
#[derive(Clone, Debug, PartialEq)]
pub struct Figure {
    /// What it shows.
    pub title: String,
    /// How to read it.
    pub caption: String,
    /// Colour (as CSS has it) and name of each series.
    pub legend: Vec<(String, String)>,
    /// The drawing.
    pub svg: String,
}

/// How numbers lie along an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// In proportion, from zero.
    Linear,
    /// By their logarithm.
    Log,
    /// Quantiles (0–1): each nine takes the same room.
    Quantile,
}

impl Scale {
    /// Where a number lies; none where the scale has no place for it.
    fn place(self, number: f64) -> Option<f64> {
        let place = match self {
            Self::Linear => number,
            Self::Log => number.log10(),
            Self::Quantile => -(1.0 - number).log10(),
        };
        place.is_finite().then_some(place)
    }

    fn label(self, place: f64) -> String {
        match self {
            Self::Linear => short(place),
            Self::Log => short(10f64.powf(place)),
            Self::Quantile => {
                let percent = 100.0 * (1.0 - 10f64.powf(-place));
                let digits = (place.round() as usize).saturating_sub(2);
                format!("{percent:.digits$} %")
            }
        }
    }

    /// Places of labels between two places.
    fn ticks(self, low: f64, high: f64) -> Vec<f64> {
        let within = |place: &f64| *place >= low - 1e-9 && *place <= high + 1e-9;
        match self {
            Self::Linear => {
                let step = nice((high - low) / TICKS);
                let first = (low / step).ceil() as i64;
                let last = (high / step).floor() as i64;
                (first..=last).map(|tick| tick as f64 * step).collect()
            }
            Self::Quantile => (0..=high.ceil() as i64)
                .map(|nines| nines as f64)
                .filter(within)
                .collect(),
            Self::Log => {
                let decades = low.floor() as i64..=high.ceil() as i64;
                let factors: &[f64] = if high - low > 2.5 {
                    &[1.0]
                } else {
                    &[1.0, 2.0, 5.0]
                };
                decades
                    .flat_map(|decade| {
                        factors
                            .iter()
                            .map(move |factor| decade as f64 + factor.log10())
                    })
                    .filter(within)
                    .collect()
            }
        }
    }
}

/// What plotters asks of an axis: places from `low` to `high`, labelled as the scale says.
struct Span {
    scale: Scale,
    low: f64,
    high: f64,
}

impl Span {
    const fn new(scale: Scale, low: f64, high: f64) -> Self {
        Self { scale, low, high }
    }
}

impl Ranged for Span {
    type FormatOption = NoDefaultFormatting;
    type ValueType = f64;

    fn map(&self, place: &f64, (from, to): (i32, i32)) -> i32 {
        let share = (place - self.low) / (self.high - self.low);
        from + (f64::from(to - from) * share).round() as i32
    }

    fn key_points<Hint: KeyPointHint>(&self, _hint: Hint) -> Vec<f64> {
        self.scale.ticks(self.low, self.high)
    }

    fn range(&self) -> std::ops::Range<f64> {
        self.low..self.high
    }
}

impl ValueFormatter<f64> for Span {
    fn format(place: &f64) -> String {
        short(*place)
    }

    fn format_ext(&self, place: &f64) -> String {
        self.scale.label(*place)
    }
}

/// An axis.
#[derive(Clone, Copy, Debug)]
pub struct Axis<'a> {
    /// What lies along it, with the unit.
    pub label: &'a str,
    /// How.
    pub scale: Scale,
}

/// A line through points `(x, y)`, each with an interval of y or without.
#[derive(Clone, Debug, Default)]
pub struct Series {
    /// Name in the legend.
    pub name: String,
    /// The points, in the order of the line.
    pub points: Vec<(f64, f64)>,
    /// Lower and upper end of the interval of each point; empty for none.
    pub intervals: Vec<(f64, f64)>,
}

/// Bars that stand together.
#[derive(Clone, Debug)]
pub struct Group {
    /// Name below them.
    pub label: String,
    /// The bars: the lengths of each one's parts, from the axis on.
    pub bars: Vec<Bar>,
}

/// One bar.
#[derive(Clone, Debug)]
pub struct Bar {
    /// Name below it.
    pub label: String,
    /// Lengths of its parts.
    pub parts: Vec<f64>,
}

/// Colour of series `index`, as CSS has it.
#[must_use]
pub fn colour(index: usize) -> String {
    let RGBColor(red, green, blue) = COLOURS[index % COLOURS.len()];
    format!("#{red:02X}{green:02X}{blue:02X}")
}

/// A line chart.
///
/// # Errors
/// No point lies on both axes.
pub fn lines(
    title: &str,
    caption: &str,
    (x, y): (Axis<'_>, Axis<'_>),
    series: &[Series],
) -> Result<Figure, FigureError> {
    let failed = |reason: String| FigureError {
        title: title.to_owned(),
        reason,
    };
    let place = |(a, b): (f64, f64)| Some((x.scale.place(a)?, y.scale.place(b)?));
    let placed: Vec<Vec<_>> = series
        .iter()
        .map(|one| one.points.iter().copied().filter_map(place).collect())
        .collect();
    let all = || placed.iter().flatten();
    let intervals = series.iter().flat_map(|one| &one.intervals);
    let ends = intervals.flat_map(|(low, high)| [*low, *high]);
    let (x_low, x_high) = range(x.scale, all().map(|point| point.0))
        .ok_or_else(|| failed("it has no points".to_owned()))?;
    let (y_low, y_high) = range(
        y.scale,
        all()
            .map(|point| point.1)
            .chain(ends.filter_map(|end| y.scale.place(end))),
    )
    .ok_or_else(|| failed("it has no points".to_owned()))?;
    let svg = draw(|area| {
        let mut chart = ChartBuilder::on(area)
            .margin(10)
            .x_label_area_size(46)
            .y_label_area_size(72)
            .build_cartesian_2d(
                Span::new(x.scale, x_low, x_high),
                Span::new(y.scale, y_low, y_high),
            )?;
        chart
            .configure_mesh()
            .axis_style(INK)
            .bold_line_style(GRID)
            .light_line_style(TRANSPARENT)
            .label_style(("sans-serif", 13).into_font().color(&INK))
            .axis_desc_style(("sans-serif", 14).into_font().color(&INK))
            .x_desc(x.label)
            .y_desc(y.label)
            .draw()?;
        for (index, (one, points)) in series.iter().zip(&placed).enumerate() {
            let colour = COLOURS[index % COLOURS.len()];
            chart.draw_series(LineSeries::new(
                points.iter().copied(),
                colour.stroke_width(2),
            ))?;
            if points.len() <= 24 {
                let marks = points
                    .iter()
                    .map(|point| Circle::new(*point, 3, colour.filled()));
                chart.draw_series(marks)?;
            }
            let bars = one
                .points
                .iter()
                .zip(&one.intervals)
                .filter_map(|(point, (low, high))| {
                    let (low, high) = (place((point.0, *low))?, place((point.0, *high))?);
                    Some(PathElement::new(
                        vec![low, high],
                        colour.mix(0.6).stroke_width(2),
                    ))
                });
            chart.draw_series(bars)?;
        }
        Ok(())
    })
    .map_err(failed)?;
    Ok(Figure {
        title: title.to_owned(),
        caption: caption.to_owned(),
        legend: series
            .iter()
            .enumerate()
            .map(|(index, one)| (colour(index), one.name.clone()))
            .collect(),
        svg,
    })
}

/// Bars of stacked parts, in groups.
///
/// # Errors
/// There is no bar, or a length is not finite.
pub fn bars(
    title: &str,
    caption: &str,
    y_label: &str,
    parts: &[&str],
    groups: &[Group],
) -> Result<Figure, FigureError> {
    let failed = |reason: String| FigureError {
        title: title.to_owned(),
        reason,
    };
    let lengths = groups
        .iter()
        .flat_map(|group| &group.bars)
        .map(|bar| bar.parts.iter().sum::<f64>());
    let (_, high) = range(Scale::Linear, lengths.filter(|length| length.is_finite()))
        .ok_or_else(|| failed("it has no bars".to_owned()))?;
    let slots: usize = groups.iter().map(|group| group.bars.len() + 1).sum();
    let svg = draw(|area| {
        let mut chart = ChartBuilder::on(area)
            .margin(10)
            .x_label_area_size(64)
            .y_label_area_size(72)
            .build_cartesian_2d(
                Span::new(Scale::Linear, 0.0, slots as f64),
                Span::new(Scale::Linear, 0.0, high),
            )?;
        chart
            .configure_mesh()
            .disable_x_mesh()
            .disable_x_axis()
            .axis_style(INK)
            .bold_line_style(GRID)
            .light_line_style(TRANSPARENT)
            .label_style(("sans-serif", 13).into_font().color(&INK))
            .axis_desc_style(("sans-serif", 14).into_font().color(&INK))
            .y_desc(y_label)
            .draw()?;
        let centred = |size: u32| {
            let position = plotters::style::text_anchor::Pos::new(
                plotters::style::text_anchor::HPos::Center,
                plotters::style::text_anchor::VPos::Top,
            );
            ("sans-serif", size).into_font().color(&INK).pos(position)
        };
        let mut slot = 0.5;
        for group in groups {
            let first = slot;
            for bar in &group.bars {
                let mut foot = 0.0;
                for (index, length) in bar.parts.iter().enumerate() {
                    let colour = COLOURS[index % COLOURS.len()];
                    let corners = [(slot + 0.08, foot), (slot + 0.92, foot + length)];
                    chart.draw_series([Rectangle::new(corners, colour.filled())])?;
                    foot += length;
                }
                let at = chart.backend_coord(&(slot + 0.5, 0.0));
                area.draw_text(&bar.label, &centred(11), (at.0, at.1 + 6))?;
                slot += 1.0;
            }
            let at = chart.backend_coord(&((first + slot) / 2.0, 0.0));
            area.draw_text(&group.label, &centred(13), (at.0, at.1 + 28))?;
            slot += 1.0;
        }
        Ok(())
    })
    .map_err(failed)?;
    Ok(Figure {
        title: title.to_owned(),
        caption: caption.to_owned(),
        legend: parts
            .iter()
            .enumerate()
            .map(|(index, part)| (colour(index), (*part).to_owned()))
            .collect(),
        svg,
    })
}

type Area<'a> = DrawingArea<SVGBackend<'a>, plotters::coord::Shift>;

fn draw(
    paint: impl FnOnce(&Area<'_>) -> Result<(), Box<dyn std::error::Error>>,
) -> Result<String, String> {
    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, (WIDTH_PX, HEIGHT_PX)).into_drawing_area();
        paint(&area).map_err(|error| error.to_string())?;
        area.present().map_err(|error| error.to_string())?;
    }
    // The page scales it, and lends it its own colour.
    let size = format!(r#"width="{WIDTH_PX}" height="{HEIGHT_PX}""#);
    Ok(svg
        .replace(&size, r#"width="100%""#)
        .replace(INK_HEX, "currentColor"))
}

/// Where an axis begins and ends, given the places on it.
fn range(scale: Scale, places: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    let (low, high) = places
        .map(|place| (place, place))
        .reduce(|(low, high), (place, _)| (low.min(place), high.max(place)))?;
    let (low, high) = match scale {
        Scale::Linear => (low.min(0.0), high),
        Scale::Quantile => (0.0, high),
        Scale::Log => (low, high),
    };
    let room = if high - low < 1e-9 {
        0.5
    } else {
        (high - low) * 0.04
    };
    match scale {
        Scale::Log => Some((low - room, high + room)),
        _ => Some((low, high + room)),
    }
}

/// The step of 1, 2 or 5 times a power of ten next above `step`.
fn nice(step: f64) -> f64 {
    let power = 10f64.powf(step.log10().floor());
    let factors = [1.0, 2.0, 5.0, 10.0];
    let factor = factors
        .into_iter()
        .find(|factor| factor * power >= step * 0.999);
    factor.unwrap_or(10.0) * power
}

/// A number in few characters.
fn short(number: f64) -> String {
    let size = number.abs();
    let scaled = |divisor: f64, suffix: &str| {
        let text = format!("{:.1}", number / divisor);
        format!("{}{suffix}", text.trim_end_matches(".0"))
    };
    match size {
        0.0 => "0".to_owned(),
        _ if size >= 999_999_500.0 => scaled(1e9, " G"),
        _ if size >= 999_999.5 => scaled(1e6, " M"),
        _ if size >= 9_999.5 => scaled(1e3, " k"),
        _ if size >= 0.999_5 => {
            let text = format!("{number:.2}");
            text.trim_end_matches('0').trim_end_matches('.').to_owned()
        }
        _ => {
            let digits = (1.0 - size.log10().floor()) as usize;
            let text = format!("{number:.digits$}");
            text.trim_end_matches('0').to_owned()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn axes(x: Scale, y: Scale) -> (Axis<'static>, Axis<'static>) {
        (
            Axis {
                label: "objects",
                scale: x,
            },
            Axis {
                label: "time, s",
                scale: y,
            },
        )
    }

    #[test]
    fn a_chart_has_a_mark_for_each_point_in_the_colour_of_its_series() {
        let series = [
            Series {
                name: "a".into(),
                points: vec![(1.0, 1.0), (10.0, 4.0)],
                intervals: vec![],
            },
            Series {
                name: "b".into(),
                points: vec![(1.0, 2.0)],
                intervals: vec![(1.0, 3.0)],
            },
        ];
        let figure = lines("t", "c", axes(Scale::Log, Scale::Linear), &series).unwrap();
        let marks = |index| {
            let fill = format!(r#"fill="{}""#, colour(index));
            figure
                .svg
                .lines()
                .filter(|line| line.contains("<circle") && line.contains(&fill))
                .count()
        };
        assert_eq!((marks(0), marks(1)), (2, 1));
        assert_eq!(figure.legend[1], (colour(1), "b".to_owned()));
        assert!(!figure.svg.contains(INK_HEX) && figure.svg.contains("currentColor"));
    }

    #[test]
    fn nothing_to_draw_is_said_so() {
        let none = lines("t", "c", axes(Scale::Log, Scale::Log), &[]);
        assert!(none.unwrap_err().to_string().contains("no points"));
        let negative = Series {
            name: "a".into(),
            points: vec![(1.0, -1.0)],
            intervals: vec![],
        };
        assert!(lines("t", "c", axes(Scale::Log, Scale::Log), &[negative]).is_err());
        assert!(bars("t", "c", "s", &[], &[]).is_err());
    }

    #[test]
    fn every_bar_and_part_is_drawn() {
        let bar = |label: &str| Bar {
            label: label.into(),
            parts: vec![1.0, 2.0],
        };
        let groups = [Group {
            label: "room".into(),
            bars: vec![bar("x"), bar("y")],
        }];
        let figure = bars("t", "c", "s", &["moving", "waiting"], &groups).unwrap();
        let parts = figure
            .svg
            .lines()
            .filter(|line| line.contains("<rect") && line.contains(&colour(1)));
        assert_eq!(parts.count(), 2);
        assert!(figure.svg.contains("room"));
    }

    #[test]
    fn ticks_are_round_numbers() {
        assert_eq!(
            Scale::Linear.ticks(0.0, 10.0),
            [0.0, 2.0, 4.0, 6.0, 8.0, 10.0]
        );
        assert_eq!(Scale::Log.ticks(0.0, 3.0), [0.0, 1.0, 2.0, 3.0]);
        let labels: Vec<_> = [0.0, 1.0, 2.0, 3.0]
            .map(|nines| Scale::Quantile.label(nines))
            .into();
        assert_eq!(labels, ["0 %", "90 %", "99 %", "99.9 %"]);
        assert_eq!(
            [0.0, 0.005_12, 0.05, 1.5, 123.456, 12_000.0, 3e6, 4e9].map(short),
            ["0", "0.0051", "0.05", "1.5", "123.46", "12 k", "3 M", "4 G"]
        );
    }

    /// A number that an element of the drawing has.
    fn number(element: &str, name: &str) -> f64 {
        let (_, rest) = element.split_once(&format!(" {name}=\"")).unwrap();
        rest.split('"').next().unwrap().parse().unwrap()
    }

    fn elements<'a>(figure: &'a Figure, word: &str) -> impl Iterator<Item = &'a str> {
        figure
            .svg
            .split('<')
            .filter(move |element| element.starts_with(word))
    }

    #[test]
    fn marks_lie_where_their_numbers_are() {
        let series = [Series {
            name: "a".into(),
            points: vec![(2.0, 1.0), (4.0, 10.0), (6.0, 100.0)],
            intervals: vec![],
        }];
        let figure = lines("t", "c", axes(Scale::Linear, Scale::Log), &series).unwrap();
        let places = |name| elements(&figure, "circle").map(move |mark| number(mark, name));
        let (across, up): (Vec<_>, Vec<_>) = (places("cx").collect(), places("cy").collect());
        // Equal steps to the right, and, by factors of ten, up; a pixel is the least.
        assert!(across[1] > across[0] + 50.0 && up[1] < up[0] - 50.0);
        assert!(
            (across[0] + across[2] - 2.0 * across[1]).abs() <= 2.0,
            "{across:?}"
        );
        assert!((up[0] + up[2] - 2.0 * up[1]).abs() <= 2.0, "{up:?}");
    }

    #[test]
    fn an_axis_holds_all_its_places() {
        for scale in [Scale::Linear, Scale::Log, Scale::Quantile] {
            for places in [vec![3.0], vec![1.0, 4.0, 2.0]] {
                let (low, high) = range(scale, places.iter().copied()).unwrap();
                assert!(places.iter().all(|place| low <= *place && *place < high));
            }
            assert_eq!(range(scale, std::iter::empty()), None);
        }
    }

    #[test]
    fn parts_of_a_bar_stand_on_one_another_above_their_labels() {
        let bars_of = |label: &str| Bar {
            label: label.into(),
            parts: vec![1.0, 2.0],
        };
        let groups = [Group {
            label: "room".into(),
            bars: vec![bars_of("x")],
        }];
        let figure = bars("t", "c", "s", &["moving", "waiting"], &groups).unwrap();
        let part = |index| {
            let fill = colour(index);
            let part = elements(&figure, "rect")
                .find(|part| part.contains(&fill))
                .unwrap();
            (number(part, "y"), number(part, "height"))
        };
        let ((low_y, low), (high_y, high)) = (part(0), part(1));
        assert!(
            (high_y + high - low_y).abs() <= 2.0,
            "{high_y} {high} {low_y}"
        );
        assert!((high - 2.0 * low).abs() <= 3.0, "{high} {low}");
        let y = |words: &str| {
            let text = elements(&figure, "text").find(|text| text.trim_end().ends_with(words));
            number(text.unwrap(), "y")
        };
        assert!(
            low_y + low < y("x") && y("x") < y("room"),
            "{} {}",
            y("x"),
            y("room")
        );
    }
}

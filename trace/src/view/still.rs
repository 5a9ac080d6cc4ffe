//! A still of a run with the ways that led to it, as the paper's Fig. 8.
//!
//! Responsible for: an SVG that looks right by itself and as an image in another page, light and
//! dark: walls; where objects start (outline) and go (dashed); the way of each robot up to the
//! given time in its colour, broad where an object went with it; robots and objects where they
//! are then.
//! Not responsible for: where that is (`story`).
//!
//! Ways are drawn a little beside each other, or those of robots that pass one doorway would hide
//! one another.

use svg::Document;
use svg::node::Node;
use svg::node::element::{Circle, Group, Polygon, Polyline, Rectangle, Style, Text, Title};

use crate::record::{Motion, Outline, Place, TaskStatus};
use crate::view::story::{Story, entry_at};

const CSS: &str = include_str!("still.css");
/// Width of the room, px.
const WIDTH: f64 = 960.0;
/// Most height of the room, px.
const HEIGHT: f64 = 1200.0;
const MARGIN: f64 = 20.0;
/// Height of a line of the legend, px.
const LINE: f64 = 28.0;
/// Colours of robots; they come again after the last.
const COLOURS: usize = 8;
/// How far the ways of neighbouring robots lie apart, px.
const APART: f64 = 3.0;

/// From metres in the world to pixels in the picture, y downwards.
#[derive(Clone, Copy)]
struct Canvas {
    scale: f64,
    low: Place,
    high: Place,
}

impl Canvas {
    fn new(low: Place, high: Place) -> Self {
        let scale = (WIDTH / (high.x - low.x)).min(HEIGHT / (high.y - low.y));
        Self { scale, low, high }
    }

    fn size(&self) -> (f64, f64) {
        let (width, height) = (self.high.x - self.low.x, self.high.y - self.low.y);
        (width * self.scale, height * self.scale)
    }

    fn point(&self, place: Place) -> (f64, f64) {
        (
            round(MARGIN + (place.x - self.low.x) * self.scale),
            round(MARGIN + (self.high.y - place.y) * self.scale),
        )
    }

    /// A shape somewhere, with a class.
    fn shape(&self, outline: &Outline, at: Place, class: &str) -> Box<dyn Node> {
        let corner = |x: f64, y: f64| self.point(Place::new(at.x + x, at.y + y));
        let corners: Vec<(f64, f64)> = match outline {
            Outline::Circle { radius } => {
                let (x, y) = self.point(at);
                let circle = Circle::new().set("cx", x).set("cy", y);
                return Box::new(
                    circle
                        .set("r", round(radius * self.scale))
                        .set("class", class),
                );
            }
            Outline::Box { half } => vec![
                corner(-half.x, -half.y),
                corner(half.x, -half.y),
                corner(half.x, half.y),
                corner(-half.x, half.y),
            ],
            Outline::Polygon { points } => points.iter().map(|p| corner(p.x, p.y)).collect(),
        };
        Box::new(
            Polygon::new()
                .set("points", list(&corners))
                .set("class", class),
        )
    }

    /// A number in the middle of a body, as large as fits; nothing where it could not be read.
    fn number(&self, number: usize, at: Place, outline: &Outline, class: &str) -> Option<Text> {
        const LEAST_PX: f64 = 6.0;
        let digits = if number > 99 { 0.8 } else { 1.0 };
        let size = (half_width(outline) * self.scale * digits).min(20.0);
        let (x, y) = self.point(at);
        (size >= LEAST_PX).then(|| {
            Text::new(number.to_string())
                .set("x", x)
                .set("y", y)
                .set("class", class)
                .set("style", format!("font-size:{}px", round(size)))
        })
    }
}

/// The still at `at_s` seconds of world time.
#[must_use]
pub fn still(story: &Story, at_s: f64) -> String {
    let at_ns = ns(at_s).min(story.until_ns);
    let scene = &story.scene;
    let canvas = Canvas::new(scene.low, scene.high);
    let (width, height) = canvas.size();
    let (legend, lines) = legend(story, at_ns, height + 2.0 * MARGIN, width + 2.0 * MARGIN);
    let (full_width, full_height) = (
        round(width + 2.0 * MARGIN),
        round(height + 2.0 * MARGIN + lines as f64 * LINE + 8.0),
    );
    let mut picture = Document::new()
        .set("viewBox", (0, 0, full_width, full_height))
        .set("width", full_width)
        .set("height", full_height)
        .set("role", "img")
        .add(Title::new(format!(
            "{} at {:.2} s",
            scene.name,
            seconds(at_ns)
        )))
        .add(Style::new(CSS))
        .add(
            rectangle(0.5, 0.5, full_width - 1.0, full_height - 1.0)
                .set("rx", 10)
                .set("class", "card"),
        )
        .add(rectangle(MARGIN, MARGIN, width, height).set("class", "floor"));
    picture = picture.add(places(story, &canvas, at_ns));
    picture = picture.add(ways(story, &canvas, at_ns));
    let mut walls = Group::new();
    let present = entry_at(&story.versions, at_ns).unwrap_or(scene);
    for wall in &present.walls {
        walls = walls.add(canvas.shape(&wall.shape, wall.at, "wall"));
    }
    let around = rectangle(MARGIN - 3.0, MARGIN - 3.0, width + 6.0, height + 6.0);
    picture = picture.add(walls.add(around.set("class", "edge")));
    picture = picture.add(bodies(story, &canvas, at_ns)).add(legend);
    picture.to_string() + "\n"
}

/// Where objects start and go, and where robots are at home.
fn places(story: &Story, canvas: &Canvas, at_ns: u64) -> Group {
    let mut group = Group::new();
    let scene = entry_at(&story.versions, at_ns).unwrap_or(&story.scene);
    for (id, home) in story.scene.homes.iter().enumerate() {
        let home = canvas.shape(&story.scene.robot.shape, *home, "home");
        group = group.add(Group::new().set("class", colour(id)).add(home));
    }
    for (id, object) in scene.objects.iter().enumerate() {
        let start = story.objects[id].start;
        group = group.add(canvas.shape(&object.shape, start, "start"));
        group = with(group, canvas.number(id, start, &object.shape, "place"));
        if let Some(goal) = object.goal {
            group = group.add(canvas.shape(&object.shape, goal, "goal"));
            group = with(group, canvas.number(id, goal, &object.shape, "place"));
        }
    }
    group
}

/// The ways up to `at_ns`: of each object in the colour of who carried it, then of each robot.
fn ways(story: &Story, canvas: &Canvas, at_ns: u64) -> Group {
    let mut group = Group::new();
    for (id, object) in story.objects.iter().enumerate() {
        for (carrier, piece) in legs(story, id, at_ns) {
            let points = way(&object.track, canvas, piece.0, piece.1);
            group = group.add(line(&points, "carried", carrier, story.robots.len()));
        }
    }
    for (id, robot) in story.robots.iter().enumerate() {
        let points = way(&robot.track, canvas, 0, at_ns);
        if points.len() > 1 {
            group = group.add(line(&points, "way", id, story.robots.len()));
        }
    }
    group
}

/// When an object was carried up to `at_ns`, and by whom.
fn legs(story: &Story, object: usize, at_ns: u64) -> Vec<(usize, (u64, u64))> {
    let doing = &story.objects[object].doing;
    let ends = doing.iter().skip(1).map(|(time_ns, _)| *time_ns);
    doing
        .iter()
        .zip(ends.chain([u64::MAX]))
        .filter(|((from_ns, doing), _)| *from_ns < at_ns && doing.status == TaskStatus::Held)
        .filter_map(|((from_ns, doing), end_ns)| {
            Some((doing.robot?, (*from_ns, end_ns.min(at_ns))))
        })
        .collect()
}

/// Corners of a body's way between two times.
fn way(track: &[Motion], canvas: &Canvas, from_ns: u64, to_ns: u64) -> Vec<(f64, f64)> {
    let mut points: Vec<(f64, f64)> = Vec::new();
    let within = track
        .iter()
        .filter(|motion| motion.start_ns < to_ns && motion.end_ns > from_ns);
    for motion in within {
        for place in [motion.at(from_ns.max(motion.start_ns)), motion.at(to_ns)] {
            let point = canvas.point(place.into());
            if points.last() != Some(&point) {
                points.push(point);
            }
        }
    }
    straightened(points)
}

/// The same line without the points that lie on the way between their neighbours.
fn straightened(points: Vec<(f64, f64)>) -> Vec<(f64, f64)> {
    /// Twice the area, px², below which three points count as lying on one line.
    const FLAT: f64 = 0.05;
    let mut kept: Vec<(f64, f64)> = Vec::new();
    for point in points {
        if let [.., a, b] = kept[..] {
            let (along, on) = ((b.0 - a.0, b.1 - a.1), (point.0 - b.0, point.1 - b.1));
            let forward = along.0 * on.0 + along.1 * on.1 > 0.0;
            if forward && (along.0 * on.1 - along.1 * on.0).abs() < FLAT {
                kept.pop();
            }
        }
        kept.push(point);
    }
    kept
}

fn line(points: &[(f64, f64)], class: &str, robot: usize, robots: usize) -> Group {
    let aside = robot.min(COLOURS) as f64 - (robots.min(COLOURS) - 1) as f64 / 2.0;
    let (dx, dy) = (round(aside * APART), round(aside * APART));
    Group::new()
        .set("class", colour(robot))
        .set("transform", format!("translate({dx} {dy})"))
        .add(
            Polyline::new()
                .set("points", list(points))
                .set("class", class),
        )
}

/// Robots and objects where they are.
fn bodies(story: &Story, canvas: &Canvas, at_ns: u64) -> Group {
    let mut group = Group::new();
    let there = |id: usize| story.objects[id].since_ns <= at_ns;
    let objects = story.scene.objects.iter().enumerate();
    for (id, object) in objects.filter(|(id, _)| there(*id)) {
        let at = story.object_at(id, at_ns);
        group = group.add(canvas.shape(&object.shape, at, "object"));
        group = with(group, canvas.number(id, at, &object.shape, ""));
    }
    let shape = &story.scene.robot.shape;
    for id in (0..story.robots.len()).filter(|&id| story.has_robot(id, at_ns)) {
        let at = story.robot_at(id, at_ns);
        let body = Group::new().set("class", colour(id));
        group = group.add(body.add(canvas.shape(shape, at, "robot")));
        group = with(group, canvas.number(id, at, shape, "on-robot"));
    }
    group
}

/// What the picture shows, below it from `top` on, and how many lines that takes.
fn legend(story: &Story, at_ns: u64, top: f64, width: f64) -> (Group, usize) {
    let scene = &story.scene;
    let small = Outline::Box {
        half: Place::new(0.5, 0.5),
    };
    let icons = Canvas {
        scale: 18.0,
        low: Place::new(0.0, 0.0),
        high: Place::new(0.0, 0.0),
    };
    let cut = if story.is_cut_short() {
        ", trace cut short"
    } else {
        ""
    };
    let title = format!("{} at {:.2} s{cut}", scene.name, seconds(at_ns));
    let mut items: Vec<(Option<Group>, String)> = vec![(None, title)];
    let icon = |class: &str| {
        let middle = Place::new(-MARGIN / 18.0, MARGIN / 18.0);
        Group::new().add(icons.shape(&small, middle, class))
    };
    for id in 0..scene.homes.len().min(COLOURS) {
        items.push((
            Some(icon("robot").set("class", colour(id))),
            format!("robot {id}"),
        ));
    }
    for (class, words) in [
        ("object", "object"),
        ("start", "its start"),
        ("goal", "its goal"),
        ("home c0", "a robot's home"),
    ] {
        items.push((Some(icon(class)), words.to_owned()));
    }
    for (class, words) in [("way", "way of a robot"), ("carried", "with an object")] {
        let stroke = Polyline::new()
            .set("points", "-10,0 10,0")
            .set("class", class);
        let icon = Group::new().set("class", colour(0)).add(stroke);
        items.push((Some(icon), words.to_owned()));
    }
    lay_out(items, top, width)
}

/// Puts items beside each other, and below where a line is full.
fn lay_out(items: Vec<(Option<Group>, String)>, top: f64, width: f64) -> (Group, usize) {
    const ICON: f64 = 28.0;
    const LETTER: f64 = 7.4;
    const BOLD: f64 = 8.8;
    const BETWEEN: f64 = 20.0;
    let (mut group, mut x, mut lines) = (Group::new(), MARGIN, 1);
    for (icon, words) in items {
        let icon_width = if icon.is_some() { ICON } else { 0.0 };
        let letter = if icon.is_some() { LETTER } else { BOLD };
        let length = icon_width + letter * words.chars().count() as f64 + BETWEEN;
        if x > MARGIN && x + length - BETWEEN > width - MARGIN {
            x = MARGIN;
            lines += 1;
        }
        let y = top + LINE * (f64::from(lines) - 0.5);
        let class = if icon.is_some() {
            "words"
        } else {
            "words name"
        };
        if let Some(icon) = icon {
            let place = format!("translate({} {})", round(x + 10.0), round(y));
            group = group.add(Group::new().set("transform", place).add(icon));
        }
        group = group.add(
            Text::new(words)
                .set("x", round(x + icon_width))
                .set("y", round(y))
                .set("class", class),
        );
        x += length;
    }
    (group, lines as usize)
}

fn rectangle(x: f64, y: f64, width: f64, height: f64) -> Rectangle {
    Rectangle::new()
        .set("x", round(x))
        .set("y", round(y))
        .set("width", round(width))
        .set("height", round(height))
}

fn with(group: Group, text: Option<Text>) -> Group {
    match text {
        Some(text) => group.add(text),
        None => group,
    }
}

fn colour(robot: usize) -> String {
    format!("c{}", robot % COLOURS)
}

/// Half of a shape's smaller width, m.
fn half_width(outline: &Outline) -> f64 {
    match outline {
        Outline::Box { half } => half.x.min(half.y),
        Outline::Circle { radius } => *radius,
        Outline::Polygon { points } => {
            let width = |coordinate: fn(&Place) -> f64| {
                let all = || points.iter().map(coordinate);
                all().fold(f64::MIN, f64::max) - all().fold(f64::MAX, f64::min)
            };
            width(|p| p.x).min(width(|p| p.y)) / 2.0
        }
    }
}

fn list(points: &[(f64, f64)]) -> String {
    let points: Vec<String> = points.iter().map(|(x, y)| format!("{x},{y}")).collect();
    points.join(" ")
}

fn seconds(time_ns: u64) -> f64 {
    time_ns as f64 / 1e9
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a time in a run, checked by the caller"
)]
fn ns(time_s: f64) -> u64 {
    (time_s * 1e9).round() as u64
}

/// To a hundredth of a pixel.
fn round(px: f64) -> f64 {
    (px * 100.0).round() / 100.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_room_fills_the_canvas_and_its_north_is_up() {
        for (wide, high) in [(6.0, 4.0), (2.0, 9.0), (0.5, 0.5)] {
            let (low, up) = (Place::new(-1.0, 2.0), Place::new(wide - 1.0, high + 2.0));
            let canvas = Canvas::new(low, up);
            let (width, height) = canvas.size();
            assert!((width / height - wide / high).abs() < 1e-9);
            assert!((width - WIDTH).abs() < 1e-9 || (height - HEIGHT).abs() < 1e-9);
            assert!(width <= WIDTH + 1e-9 && height <= HEIGHT + 1e-9);
            let below = (MARGIN, round(MARGIN + height));
            assert_eq!(canvas.point(low), below);
            assert_eq!(canvas.point(up), (round(MARGIN + width), MARGIN));
        }
    }

    #[test]
    fn a_line_keeps_its_bends_and_where_it_turns_back() {
        let line = [
            (0.0, 0.0),
            (1.0, 0.0),
            (2.0, 0.0),
            (2.0, 1.0),
            (2.0, 2.0),
            (2.0, 1.0),
            (3.0, 2.0),
        ];
        let kept = [(0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (2.0, 1.0), (3.0, 2.0)];
        assert_eq!(straightened(line.to_vec()), kept);
        assert_eq!(list(&[(1.0, 2.5), (3.0, 4.0)]), "1,2.5 3,4");
    }

    #[test]
    fn the_legend_breaks_lines_between_items_that_do_not_fit_beside_each_other() {
        let lines = |lengths: &[usize]| {
            let items = lengths.iter().map(|length| (None, "x".repeat(*length)));
            lay_out(items.collect(), 0.0, 300.0).1
        };
        assert_eq!(lines(&[5, 5]), 1);
        assert_eq!(lines(&[20, 20]), 2);
        // What fits nowhere has a line of its own, and no empty one before it.
        assert_eq!(lines(&[200]), 1);
        assert_eq!(lines(&[5, 200, 5]), 3);
    }
}

//! The paper's figures from our runs.
//!
//! Responsible for: execution and planning of each method (Fig. 6), planning against the number of
//! robots (Fig. 7), success rates, where speeds turn the picture.
//! Not responsible for: drawing itself (`figure`).

use super::run::ACTIVITIES;
use super::{VARIANTS, number, runs};
use crate::figure::{Axis, Bar, Figure, FigureError, Group, Scale, Series, bars, lines};
use crate::results::{Results, Table, Value};
use crate::stats::{mean, mean_interval};

/// All figures that the rows allow.
///
/// # Errors
/// A figure cannot be drawn.
pub fn all(results: &Results) -> Result<Vec<Figure>, FigureError> {
    let Some(table) = runs(results).filter(|table| !table.rows.is_empty()) else {
        return Ok(Vec::new());
    };
    let mut figures = Vec::new();
    for world in worlds(table) {
        figures.push(times(table, &world)?);
    }
    for world in worlds(table) {
        figures.extend(planning(table, &world)?);
    }
    figures.push(solved(table)?);
    Ok(figures)
}

/// Values of a column in the order of the rows.
fn values(table: &Table, name: &str) -> Vec<String> {
    let mut values = Vec::new();
    for row in &table.rows {
        let value = table.position(name).map(|index| row[index].to_string());
        if let Some(value) = value.filter(|value| !values.contains(value)) {
            values.push(value);
        }
    }
    values
}

/// Set of rooms, computer and modelled speed: each has figures of its own.
struct World {
    keys: Vec<(&'static str, String)>,
}

impl World {
    fn words(&self) -> String {
        let values: Vec<_> = self.keys.iter().map(|(_, value)| value.as_str()).collect();
        format!(
            "{} rooms, {} computer, {} units/s",
            values[0], values[1], values[2]
        )
    }

    /// The rows of this world that have `more` as well.
    fn rows<'a>(
        &'a self,
        table: &'a Table,
        more: &'a [(&'a str, &'a str)],
    ) -> impl Iterator<Item = &'a Vec<Value>> {
        let own = self.keys.iter().map(|(key, value)| (*key, value.as_str()));
        let keys: Vec<_> = own.chain(more.iter().copied()).collect();
        table.rows.iter().filter(move |row| {
            keys.iter().all(|(key, value)| {
                table
                    .position(key)
                    .is_some_and(|index| row[index].to_string() == *value)
            })
        })
    }
}

fn worlds(table: &Table) -> Vec<World> {
    let mut worlds = Vec::new();
    for set in values(table, "set") {
        for compute in values(table, "compute") {
            for speed in values(table, "units_per_second") {
                let keys = vec![
                    ("set", set.clone()),
                    ("compute", compute.clone()),
                    ("units_per_second", speed),
                ];
                worlds.push(World { keys });
            }
        }
    }
    worlds.retain(|world| world.rows(table, &[]).next().is_some());
    worlds
}

/// Fig. 6: how the robots' time is spent, per method and number of robots, over solved runs.
fn times(table: &Table, world: &World) -> Result<Figure, FigureError> {
    let groups: Vec<_> = values(table, "robots")
        .iter()
        .map(|robots| Group {
            label: format!("{robots} robots"),
            bars: VARIANTS
                .iter()
                .map(|variant| {
                    let keys = [
                        ("robots", robots.as_str()),
                        ("method", variant.word()),
                        ("solved", "1"),
                    ];
                    let rows: Vec<_> = world.rows(table, &keys).collect();
                    let part = |column: &str| {
                        let numbers: Vec<_> = rows
                            .iter()
                            .filter_map(|row| number(table, row, column))
                            .collect();
                        mean(&numbers).unwrap_or(0.0)
                    };
                    Bar {
                        label: initials(variant.word()).to_owned(),
                        parts: ACTIVITIES.map(|(_, column)| part(column)).into(),
                    }
                })
                .collect(),
        })
        .collect();
    bars(
        &format!("How the robots spend their time: {}", world.words()),
        "World seconds, mean over robots and solved runs; GR grasping and restricted (the paper's), R restricted, A all (cached), AL all (literal), N no action.",
        "time, s",
        &["moving", "computing", "waiting", "gripping", "idle"],
        &groups,
    )
}

/// Fig. 7: planning time against the number of robots.
fn planning(table: &Table, world: &World) -> Result<Option<Figure>, FigureError> {
    let robots = values(table, "robots");
    let series: Vec<_> = VARIANTS
        .iter()
        .map(|variant| {
            let mut series = Series {
                name: variant.word().to_owned(),
                ..Series::default()
            };
            for count in &robots {
                let keys = [
                    ("robots", count.as_str()),
                    ("method", variant.word()),
                    ("solved", "1"),
                ];
                let numbers: Vec<_> = world
                    .rows(table, &keys)
                    .filter_map(|row| number(table, row, "computing_s"))
                    .collect();
                if let (Some(estimate), Ok(count)) = (mean_interval(&numbers), count.parse()) {
                    series.points.push((count, estimate.value));
                    series.intervals.push((estimate.low, estimate.high));
                }
            }
            series
        })
        .collect();
    if robots.len() < 2 || series.iter().all(|one| one.points.is_empty()) {
        return Ok(None);
    }
    let (x, y) = (
        Axis {
            label: "robots",
            scale: Scale::Linear,
        },
        Axis {
            label: "planning, s",
            scale: Scale::Linear,
        },
    );
    let title = format!("Planning against the number of robots: {}", world.words());
    let caption =
        "Computing, mean over robots and solved runs, with 95 % intervals over the rooms.";
    lines(&title, caption, (x, y), &series).map(Some)
}

/// Success rates: runs that ended solved, of all.
fn solved(table: &Table) -> Result<Figure, FigureError> {
    let groups: Vec<_> = values(table, "set")
        .iter()
        .flat_map(|set| {
            values(table, "robots")
                .into_iter()
                .map(move |robots| Group {
                    label: format!("{set}, {robots}"),
                    bars: VARIANTS
                        .iter()
                        .map(|variant| {
                            let keys = [
                                ("set", set.as_str()),
                                ("robots", robots.as_str()),
                                ("method", variant.word()),
                            ];
                            let numbers: Vec<_> = table.numbers("solved", &keys).collect();
                            Bar {
                                label: initials(variant.word()).to_owned(),
                                parts: vec![100.0 * mean(&numbers).unwrap_or(0.0)],
                            }
                        })
                        .collect(),
                })
        })
        .collect();
    bars(
        "Runs that end solved",
        "Per cent of all runs, by set of rooms and number of robots.",
        "solved, %",
        &["solved"],
        &groups,
    )
}

/// What stands below a bar.
fn initials(method: &str) -> &str {
    match method {
        "grasping-and-restricted" => "GR",
        "restricted" => "R",
        "all" => "A",
        "all-literal" => "AL",
        "no-action" => "N",
        other => other,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_method_has_its_line_and_is_named() {
        let columns = [
            "set",
            "compute",
            "units_per_second",
            "robots",
            "method",
            "solved",
        ];
        let table = (columns.into_iter()).fold(Table::new("runs", "Runs"), |table, name| {
            table.key(name, "", "")
        });
        let mut table = table.key("computing_s", "", "");
        for robots in ["1", "2"] {
            for variant in VARIANTS {
                let keys = ["small", "one", "100", robots, variant.word(), "1"].map(Value::from);
                table.push(keys.into_iter().chain([Value::Number(2.5)]).collect());
            }
        }
        let [world] = &worlds(&table)[..] else {
            panic!("there is one");
        };
        let figure = planning(&table, world).unwrap().unwrap();
        let names = figure.legend.iter().map(|(_, name)| name.as_str());
        assert!(names.eq(VARIANTS.iter().map(|variant| variant.word())));
    }

    #[test]
    fn values_come_once_each_in_the_order_of_the_rows() {
        let mut table = Table::new("runs", "Runs").key("room", "", "");
        for room in ["b", "a", "b", "c", "a"] {
            table.push(vec![room.into()]);
        }
        assert_eq!(values(&table, "room"), ["b", "a", "c"]);
        assert!(values(&table, "no such column").is_empty());
    }
}

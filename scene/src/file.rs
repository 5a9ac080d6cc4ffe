//! The scenario file, field by field as TOML spells it.
//!
//! Responsible for: the names in the file, what may be left out, and where each entry stands.
//! Not responsible for: what the numbers mean together (`validate`), reporting (`scenario`).

use schemars::JsonSchema;
use serde::de::Error as _;
use serde::{Deserialize, Deserializer};
use toml::Spanned;

use crate::build::default_grasp;
use crate::draft::{
    DEFAULT_RESOLUTION_M, Draft, Event, Move, ObjectDraft, RobotDraft, ShapeDraft, UserOrder,
    WallDraft,
};
use crate::lattice::Connectivity;
use crate::problem::{Key, Problem};

/// A scenario: robots that bring objects to their goals among walls. Lengths in metres, durations
/// in seconds, one world frame.
#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct ScenarioFile {
    /// Name of the scenario.
    #[schemars(with = "String")]
    name: Spanned<String>,
    /// Planning cell, used where the lengths of the room allow no exact lattice; 0.1 by default.
    #[schemars(with = "Option<f64>")]
    resolution: Option<Spanned<f64>>,
    /// Steps from a planning cell: 8 (default, without cutting corners) or 4.
    #[schemars(with = "Option<u8>", extend("enum" = [4, 8]))]
    connectivity: Option<Spanned<u8>>,
    /// What all robots have in common.
    robot: RobotTable,
    /// What holds for every object that does not say otherwise.
    #[serde(default)]
    object: ObjectDefaults,
    /// The room.
    workspace: WorkspaceTable,
    /// The robots, each with its home.
    #[serde(default)]
    robots: Vec<HomeTable>,
    /// The objects.
    #[serde(default)]
    objects: Vec<ObjectTable>,
    /// The user's own order of events.
    #[serde(default)]
    before: Vec<BeforeTable>,
    /// Moves that solve the scenario one after the other, as a generator leaves them.
    #[serde(default)]
    certificate: Vec<MoveTable>,
}

#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct RobotTable {
    /// Shape around the robot's centre.
    #[schemars(with = "ShapeDraft")]
    shape: Spanned<ShapeDraft>,
    /// Speed, m/s.
    #[schemars(with = "f64")]
    speed: Spanned<f64>,
    /// Distance kept from everything but what is grasped, m; 0 by default.
    #[schemars(with = "Option<f64>")]
    clearance: Option<Spanned<f64>>,
    /// Duration of a grasp, s; 0 by default.
    #[schemars(with = "Option<f64>")]
    grasp_s: Option<Spanned<f64>>,
    /// Duration of a release, s; 0 by default.
    #[schemars(with = "Option<f64>")]
    release_s: Option<Spanned<f64>>,
}

#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct ObjectDefaults {
    /// Shape around the object's centre.
    #[schemars(with = "Option<ShapeDraft>")]
    shape: Option<Spanned<ShapeDraft>>,
    /// Robot centre minus object centre while grasped; by default the robot is centred against
    /// the object's −y side.
    #[schemars(with = "Option<[f64; 2]>")]
    grasp: Option<Spanned<Numbers<2>>>,
    /// Several grasps, any of which will do, in the place of one.
    #[schemars(with = "Option<Vec<[f64; 2]>>")]
    grasps: Option<Spanned<Vec<Numbers<2>>>>,
    /// Whether robots that carry nothing may pass under the object while it is on the ground.
    pass_under: Option<bool>,
}

#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct WorkspaceTable {
    /// Lower left and upper right corner: x0, y0, x1, y1.
    #[schemars(with = "[f64; 4]")]
    bounds: Spanned<Numbers<4>>,
    /// Walls inside the bounds, in world coordinates.
    #[serde(default)]
    #[schemars(with = "Vec<WallDraft>")]
    walls: Vec<Spanned<WallDraft>>,
}

#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct HomeTable {
    /// Where the robot's centre is at the start, and where it returns to.
    #[schemars(with = "[f64; 2]")]
    home: Spanned<Numbers<2>>,
}

#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct ObjectTable {
    /// Where the object's centre is at the start.
    #[schemars(with = "[f64; 2]")]
    start: Spanned<Numbers<2>>,
    /// Where its centre shall be; without one it is clutter that may be moved.
    #[schemars(with = "Option<[f64; 2]>")]
    goal: Option<Spanned<Numbers<2>>>,
    /// Objects of one kind are interchangeable: any of them may stand at any of the goals that they
    /// state.
    #[schemars(with = "Option<String>")]
    kind: Option<Spanned<String>>,
    /// Shape around its centre, if not that of `[object]`.
    #[schemars(with = "Option<ShapeDraft>")]
    shape: Option<Spanned<ShapeDraft>>,
    /// Robot centre minus object centre while grasped, if not that of `[object]`.
    #[schemars(with = "Option<[f64; 2]>")]
    grasp: Option<Spanned<Numbers<2>>>,
    /// Several grasps, any of which will do, in the place of one.
    #[schemars(with = "Option<Vec<[f64; 2]>>")]
    grasps: Option<Spanned<Vec<Numbers<2>>>>,
    /// Whether robots may pass under it, if not as `[object]` says.
    pass_under: Option<bool>,
}

#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct BeforeTable {
    /// The event that comes first: task (counted from 0), dot, start, grasp or finish.
    #[schemars(with = "String", regex(pattern = r"^[0-9]+\.(start|grasp|finish)$"))]
    first: Spanned<String>,
    /// The event that comes later.
    #[schemars(with = "String", regex(pattern = r"^[0-9]+\.(start|grasp|finish)$"))]
    then: Spanned<String>,
}

#[derive(Debug, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct MoveTable {
    /// The object that is carried, counted from 0.
    #[schemars(with = "usize")]
    object: Spanned<usize>,
    /// Where its centre is before.
    #[serde(deserialize_with = "numbers")]
    from: [f64; 2],
    /// Where its centre is afterwards.
    #[serde(deserialize_with = "numbers")]
    to: [f64; 2],
}

/// So many numbers: an array in the file may be neither shorter nor longer.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Numbers<const N: usize>(pub(crate) [f64; N]);

impl<'de, const N: usize> Deserialize<'de> for Numbers<N> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let numbers = Vec::<f64>::deserialize(deserializer)?;
        let given = numbers.len();
        numbers.try_into().map(Self).map_err(|_| {
            let verb = if given == 1 { "is" } else { "are" };
            D::Error::custom(format!("takes {N} numbers, but {given} {verb} given"))
        })
    }
}

/// [`Numbers`] as a plain array.
pub(crate) fn numbers<'de, D: Deserializer<'de>, const N: usize>(
    deserializer: D,
) -> Result<[f64; N], D::Error> {
    Numbers::deserialize(deserializer).map(|numbers| numbers.0)
}

/// A list of [`Numbers`] as plain arrays.
pub(crate) fn lists<'de, D: Deserializer<'de>, const N: usize>(
    deserializer: D,
) -> Result<Vec<[f64; N]>, D::Error> {
    let lists = Vec::<Numbers<N>>::deserialize(deserializer)?;
    Ok(lists.into_iter().map(|numbers| numbers.0).collect())
}

/// A range of bytes of the text.
pub(crate) type Range = std::ops::Range<usize>;

fn value<T: Copy>(entry: Option<&Spanned<T>>, default: T) -> T {
    entry.map_or(default, |entry| *entry.get_ref())
}

fn span<T>(entry: Option<&Spanned<T>>) -> Option<Range> {
    entry.map(Spanned::span)
}

impl ScenarioFile {
    /// What the file states.
    ///
    /// # Errors
    /// Entries that state nothing: an event that is none, an object without a shape.
    pub(crate) fn draft(&self) -> Result<Draft, Vec<Problem>> {
        let mut problems = Vec::new();
        let connectivity = match value(self.connectivity.as_ref(), 8) {
            4 => Connectivity::Four,
            8 => Connectivity::Eight,
            other => {
                problems.push(Problem::new(
                    Key::Top("connectivity"),
                    format!("{other} steps from a cell are not supported; 4 and 8 are"),
                ));
                Connectivity::Eight
            }
        };
        let robot = self.robot.draft();
        let mut objects = Vec::new();
        for (i, object) in self.objects.iter().enumerate() {
            match object.draft(&self.object, &robot) {
                Some(object) => objects.push(object),
                None => problems.push(
                    Problem::new(Key::Object(i, "shape"), "has no shape")
                        .help("give it a shape, or all objects one under [object]"),
                ),
            }
        }
        for (i, object) in self.objects.iter().enumerate() {
            let stated = [
                (&object.grasp, &object.grasps),
                (&self.object.grasp, &self.object.grasps),
            ];
            for (one, several) in stated {
                let none = several
                    .as_ref()
                    .is_some_and(|list| list.get_ref().is_empty());
                if one.is_some() && several.is_some() {
                    let message = "stands beside grasp; one of the two will do";
                    problems.push(Problem::new(Key::Object(i, "grasps"), message));
                } else if none {
                    let message = "is empty, but robots have to hold it somehow";
                    problems.push(Problem::new(Key::Object(i, "grasps"), message));
                }
            }
        }
        let mut before = Vec::new();
        for (i, order) in self.before.iter().enumerate() {
            match (event(order.first.get_ref()), event(order.then.get_ref())) {
                (Some(first), Some(then)) => before.push(UserOrder { first, then }),
                (first, _) => {
                    let (key, text) = match first {
                        None => ("first", &order.first),
                        Some(_) => ("then", &order.then),
                    };
                    problems.push(
                        Problem::new(
                            Key::Before(i, key),
                            format!("\"{}\" names no event of a task", text.get_ref()),
                        )
                        .help("write the task's number, a dot, and start, grasp or finish: \"0.finish\""),
                    );
                }
            }
        }
        if !problems.is_empty() {
            return Err(problems);
        }
        Ok(Draft {
            name: self.name.get_ref().clone(),
            resolution_m: value(self.resolution.as_ref(), DEFAULT_RESOLUTION_M),
            connectivity,
            bounds: self.workspace.bounds.get_ref().0,
            walls: self
                .workspace
                .walls
                .iter()
                .map(|wall| wall.get_ref().clone())
                .collect(),
            robot,
            homes: self.robots.iter().map(|r| r.home.get_ref().0).collect(),
            objects,
            before,
            certificate: self
                .certificate
                .iter()
                .map(|m| Move {
                    object: *m.object.get_ref(),
                    from: m.from,
                    to: m.to,
                })
                .collect(),
        })
    }

    /// Where a key stands, if the file has it.
    pub(crate) fn place(&self, key: Key) -> Option<Range> {
        match key {
            Key::Top("name") => Some(self.name.span()),
            Key::Top("resolution") => span(self.resolution.as_ref()),
            Key::Top("connectivity") => span(self.connectivity.as_ref()),
            Key::Top(_) => None,
            Key::Robot("speed") => Some(self.robot.speed.span()),
            Key::Robot("clearance") => span(self.robot.clearance.as_ref()),
            Key::Robot("grasp_s") => span(self.robot.grasp_s.as_ref()),
            Key::Robot("release_s") => span(self.robot.release_s.as_ref()),
            Key::Robot(_) => Some(self.robot.shape.span()),
            Key::Workspace(_) => Some(self.workspace.bounds.span()),
            Key::Wall(i) => self.workspace.walls.get(i).map(Spanned::span),
            Key::Home(i) => self.robots.get(i).map(|robot| robot.home.span()),
            Key::Object(i, field) => self.objects.get(i).map(|o| o.place(&self.object, field)),
            Key::Before(i, "then") => self.before.get(i).map(|order| order.then.span()),
            Key::Before(i, _) => self.before.get(i).map(|order| order.first.span()),
            Key::Certificate(i) => self.certificate.get(i).map(|m| m.object.span()),
        }
    }
}

impl RobotTable {
    fn draft(&self) -> RobotDraft {
        RobotDraft {
            shape: self.shape.get_ref().clone(),
            speed_m_per_s: *self.speed.get_ref(),
            clearance_m: value(self.clearance.as_ref(), 0.0),
            grasp_s: value(self.grasp_s.as_ref(), 0.0),
            release_s: value(self.release_s.as_ref(), 0.0),
        }
    }
}

impl ObjectTable {
    fn draft(&self, defaults: &ObjectDefaults, robot: &RobotDraft) -> Option<ObjectDraft> {
        let shape = self.shape.as_ref().or(defaults.shape.as_ref())?;
        let shape = shape.get_ref().clone();
        let own = stated(self.grasp.as_ref(), self.grasps.as_ref());
        let all = stated(defaults.grasp.as_ref(), defaults.grasps.as_ref());
        let grasps = own.or(all).unwrap_or_default();
        let (grasp, others) = match grasps.split_first() {
            Some((first, others)) => (*first, others.to_vec()),
            None => (default_grasp(&robot.shape, &shape), Vec::new()),
        };
        Some(ObjectDraft {
            grasp,
            other_grasps: others,
            kind: self.kind.as_ref().map(|kind| kind.get_ref().clone()),
            shape,
            pass_under: self.pass_under.or(defaults.pass_under).unwrap_or(false),
            start: self.start.get_ref().0,
            goal: self.goal.as_ref().map(|goal| goal.get_ref().0),
        })
    }

    /// Where a key of this object stands: with it, with the defaults, or else its start.
    fn place(&self, defaults: &ObjectDefaults, field: &str) -> Range {
        let own = match field {
            "goal" => span(self.goal.as_ref()),
            "kind" => span(self.kind.as_ref()),
            "shape" => span(self.shape.as_ref()).or_else(|| span(defaults.shape.as_ref())),
            "grasp" | "grasps" => (span(self.grasp.as_ref()))
                .or_else(|| span(self.grasps.as_ref()))
                .or_else(|| span(defaults.grasp.as_ref()))
                .or_else(|| span(defaults.grasps.as_ref())),
            _ => None,
        };
        own.unwrap_or_else(|| self.start.span())
    }
}

/// The grasps stated: one, or a list of them.
fn stated(
    one: Option<&Spanned<Numbers<2>>>,
    several: Option<&Spanned<Vec<Numbers<2>>>>,
) -> Option<Vec<[f64; 2]>> {
    let several = || several.map(|list| list.get_ref().iter().map(|numbers| numbers.0).collect());
    one.map(|grasp| vec![grasp.get_ref().0]).or_else(several)
}

/// "0.finish" as task and event.
fn event(text: &str) -> Option<(usize, Event)> {
    let (task, word) = text.split_once('.')?;
    let event = Event::ALL.into_iter().find(|event| event.word() == word)?;
    Some((task.parse().ok()?, event))
}

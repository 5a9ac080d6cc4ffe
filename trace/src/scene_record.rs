//! The scene as a trace tells it.
//!
//! Responsible for: translating a checked scenario.
//! Not responsible for: what it means; nothing else in this crate knows the crate `scene`.

use scene::{Scene, Settings, ShapeOutline};

use crate::record::{
    FORMAT, Instant, Object, Order, Outline, Place, RobotKind, SceneRecord, TaskInstant, Wall,
};

/// Walls that a scene has around its bounds, behind those of the scenario. A trace tells the
/// bounds as such.
const BOUND_WALLS: usize = 4;

impl SceneRecord {
    /// What a trace of a run of `scene` begins with.
    #[must_use]
    pub fn new(scene: &Scene, settings: &Settings, run_id: u64) -> Self {
        let walls = &scene.walls[..scene.walls.len().saturating_sub(BOUND_WALLS)];
        Self {
            format: FORMAT,
            program_version: env!("CARGO_PKG_VERSION").to_owned(),
            name: scene.name.clone(),
            scenario_hash: format!("{:016x}", scene.hash),
            run_id: format!("{run_id:016x}"),
            low: scene.bounds.0.into(),
            high: scene.bounds.1.into(),
            walls: walls
                .iter()
                .map(|(shape, at)| wall(shape.outline(), (*at).into()))
                .collect(),
            robot: RobotKind {
                shape: scene.robot.shape.outline().into(),
                speed_m_per_s: scene.robot.speed_m_per_s,
                clearance_m: scene.robot.clearance_m,
                grasp_ns: scene.robot.grasp_ns,
                release_ns: scene.robot.release_ns,
            },
            homes: scene.homes.iter().map(|home| (*home).into()).collect(),
            objects: scene.objects.iter().map(object).collect(),
            before: scene.before.iter().map(order).collect(),
            // Numbers and words have a JSON form; `null` here would only be less to read.
            settings: serde_json::to_value(settings).unwrap_or_default(),
        }
    }
}

fn wall(outline: ShapeOutline, at: Place) -> Wall {
    Wall {
        shape: outline.into(),
        at,
    }
}

fn object(object: &scene::ObjectSpec) -> Object {
    Object {
        shape: object.shape.outline().into(),
        grasp: object.grasp.into(),
        other_grasps: (object.grasps.iter().skip(1))
            .map(|grasp| grasp.offset.into())
            .collect(),
        pass_under: object.pass_under,
        kind: object.kind,
        start: object.start.into(),
        goal: object.goal.map(Place::from),
    }
}

fn order(order: &scene::UserOrder) -> Order {
    let instant = |(task, event): (usize, scene::Event)| TaskInstant {
        task,
        instant: match event {
            scene::Event::Start => Instant::Start,
            scene::Event::Grasp => Instant::Grasp,
            scene::Event::Finish => Instant::Finish,
        },
    };
    Order {
        first: instant(order.first),
        then: instant(order.then),
    }
}

impl From<ShapeOutline> for Outline {
    fn from(outline: ShapeOutline) -> Self {
        let place = |[x, y]: [f64; 2]| Place::new(x, y);
        match outline {
            ShapeOutline::Box { half } => Self::Box { half: place(half) },
            ShapeOutline::Circle { radius } => Self::Circle { radius },
            ShapeOutline::Polygon { points } => Self::Polygon {
                points: points.into_iter().map(place).collect(),
            },
        }
    }
}

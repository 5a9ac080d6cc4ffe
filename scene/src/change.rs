//! Changes of a scene while a run goes on.
//!
//! Responsible for: what can change, and the next version of a scene that follows from it.
//! Not responsible for: where bodies are by then, and so whether a change can be made (crate
//! `world`).
//!
//! Terms: scenes do not change; a change makes a *version* of the scene, with a canonical text and
//! a hash of its own. In a version, an object's *start* is only where it was put by hand last, at
//! the start or by a [`Change::Move`]: it may stand elsewhere, and something else may stand there.

use serde::{Deserialize, Serialize};
use shm_types::{ChangeKind, Point, SceneChange};

use crate::draft::{Draft, ObjectDraft, WallDraft};
use crate::geometry::{Vec2, overlap};
use crate::problem::Problems;
use crate::scene::Scene;
use crate::shape::Shape;

/// Half the width of what a wall must overlap to stand at a point, m.
const AT_POINT_M: f64 = 1e-3;

/// One way in which a scene changes. Lengths are metres.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum Change {
    /// An object is to go elsewhere, or nowhere any more.
    Goal {
        /// Which.
        object: usize,
        /// Where its centre shall be.
        to: Option<[f64; 2]>,
    },
    /// Somebody has moved an object.
    Move {
        /// Which.
        object: usize,
        /// Where its centre is now.
        to: [f64; 2],
    },
    /// There is one more object. It gets the next number.
    AddObject {
        /// Where its centre is.
        at: [f64; 2],
        /// Where it shall be.
        goal: Option<[f64; 2]>,
        /// It has shape and grasp of this object.
        like: usize,
    },
    /// There is one more wall: a box, from its lower left to its upper right corner.
    Close {
        /// x0, y0, x1, y1.
        corners: [f64; 4],
    },
    /// A wall is gone: the one at this point.
    Open {
        /// A point that this wall alone covers.
        at: [f64; 2],
    },
    /// There is one more robot. It gets the next number.
    AddRobot {
        /// Where its centre is: its home.
        at: [f64; 2],
    },
}

/// Why there is no such version of a scene.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ChangeError {
    /// An object that does not exist.
    #[error("there is no object {object}: the run has {count}, counted from 0")]
    NoObject {
        /// The number given.
        object: usize,
        /// How many there are.
        count: usize,
    },
    /// Not one wall at a point.
    #[error("{} walls cover the point {}, {}: give a point that the one to take away covers alone", found, at[0], at[1])]
    NotOneWall {
        /// The point.
        at: [f64; 2],
        /// How many walls cover it.
        found: usize,
    },
    /// The scene would not be sound.
    #[error(transparent)]
    Unsound(#[from] Problems),
}

impl Scene {
    /// The version of this scene that all of `changes` lead to, one after the other.
    ///
    /// # Errors
    /// The first that cannot be made, or all that would be wrong with the scene.
    pub fn changed(&self, changes: &[Change]) -> Result<Self, ChangeError> {
        let mut draft = self.draft().clone();
        draft.certificate.clear();
        for change in changes {
            change.apply(&mut draft)?;
        }
        Ok(Self::version(draft)?)
    }
}

impl Change {
    fn apply(&self, draft: &mut Draft) -> Result<(), ChangeError> {
        match *self {
            Self::Goal { object, to } => object_mut(draft, object)?.goal = to,
            Self::Move { object, to } => object_mut(draft, object)?.start = to,
            Self::AddObject { at, goal, like } => {
                let object = ObjectDraft {
                    start: at,
                    goal,
                    ..object_mut(draft, like)?.clone()
                };
                draft.objects.push(object);
            }
            Self::Close { corners } => draft.walls.push(WallDraft::Box(corners)),
            Self::Open { at } => {
                let covers = |wall: &&WallDraft| covers(wall, at);
                let found = draft.walls.iter().filter(covers).count();
                if found != 1 {
                    return Err(ChangeError::NotOneWall { at, found });
                }
                draft.walls.retain(|wall| !covers(&wall));
            }
            Self::AddRobot { at } => draft.homes.push(at),
        }
        Ok(())
    }

    /// The object that stands elsewhere by this change.
    #[must_use]
    pub const fn moved(&self) -> Option<usize> {
        match self {
            Self::Move { object, .. } => Some(*object),
            _ => None,
        }
    }

    /// As it travels.
    #[must_use]
    pub fn to_wire(&self) -> SceneChange {
        let point = |[x, y]: [f64; 2]| Point::new(x, y);
        let number = |object: usize| u32::try_from(object).unwrap_or(u32::MAX);
        let goal = |to: Option<[f64; 2]>| SceneChange {
            to: to.map_or(Point::default(), point),
            has_goal: u32::from(to.is_some()),
            ..SceneChange::default()
        };
        let (kind, change) = match *self {
            Self::Goal { object, to } => {
                let object = number(object);
                (ChangeKind::Goal, SceneChange { object, ..goal(to) })
            }
            Self::Move { object, to } => {
                let (object, at) = (number(object), point(to));
                let change = SceneChange {
                    object,
                    at,
                    ..goal(None)
                };
                (ChangeKind::Move, change)
            }
            Self::AddObject { at, goal: to, like } => {
                let (object, at) = (number(like), point(at));
                let change = SceneChange {
                    object,
                    at,
                    ..goal(to)
                };
                (ChangeKind::Add, change)
            }
            Self::Close {
                corners: [x0, y0, x1, y1],
            } => {
                let change = SceneChange {
                    at: Point::new(x0, y0),
                    to: Point::new(x1, y1),
                    ..goal(None)
                };
                (ChangeKind::Close, change)
            }
            Self::Open { at } => {
                let at = point(at);
                (ChangeKind::Open, SceneChange { at, ..goal(None) })
            }
            Self::AddRobot { at } => {
                let at = point(at);
                (ChangeKind::AddRobot, SceneChange { at, ..goal(None) })
            }
        };
        SceneChange {
            kind: kind.code(),
            ..change
        }
    }

    /// What came over the wire; none for a message that is no legal one.
    #[must_use]
    pub fn from_wire(change: &SceneChange) -> Option<Self> {
        let place = |point: Point| [point.x, point.y];
        let object = change.object as usize;
        let goal = (change.has_goal == 1).then_some(place(change.to));
        Some(match ChangeKind::decode(change.kind).ok()? {
            ChangeKind::Goal => Self::Goal { object, to: goal },
            ChangeKind::Move => Self::Move {
                object,
                to: place(change.at),
            },
            ChangeKind::Add => Self::AddObject {
                at: place(change.at),
                goal,
                like: object,
            },
            ChangeKind::Close => Self::Close {
                corners: [change.at.x, change.at.y, change.to.x, change.to.y],
            },
            ChangeKind::Open => Self::Open {
                at: place(change.at),
            },
            ChangeKind::AddRobot => Self::AddRobot {
                at: place(change.at),
            },
        })
    }
}

fn object_mut(draft: &mut Draft, object: usize) -> Result<&mut ObjectDraft, ChangeError> {
    let count = draft.objects.len();
    let found = draft.objects.get_mut(object);
    found.ok_or(ChangeError::NoObject { object, count })
}

/// Whether a wall covers a point; no for one that is none.
fn covers(wall: &WallDraft, [x, y]: [f64; 2]) -> bool {
    let (Ok((shape, at)), Ok(point)) = (
        crate::build::wall_shape(wall),
        Shape::rectangle(Vec2::new(2.0, 2.0) * AT_POINT_M),
    ) else {
        return false;
    };
    overlap(&shape, at, &point, Vec2::new(x, y))
}

#[cfg(test)]
mod tests {
    use shm_types::capacity::MAX_ROBOTS;

    use super::*;

    const ROOM: &str = "name = \"room\"\n[robot]\nshape = { box = [0.5, 0.5] }\nspeed = 0.5\n\
        [object]\nshape = { box = [0.4, 0.4] }\n[workspace]\nbounds = [0.0, 0.0, 6.0, 3.0]\n\
        walls = [{ box = [3.0, 1.0, 3.2, 3.0] }]\n[[robots]]\nhome = [0.5, 0.5]\n\
        [[objects]]\nstart = [2.0, 2.0]\ngoal = [5.0, 2.0]\n\
        [[objects]]\nstart = [1.0, 2.0]\ngoal = [4.0, 2.0]\n";

    fn room() -> Scene {
        crate::parse(ROOM, "room").unwrap()
    }

    #[test]
    fn a_version_reads_back_from_its_canonical_text() {
        let changes = [
            Change::Goal {
                object: 0,
                to: None,
            },
            // The first goal is free now.
            Change::Goal {
                object: 1,
                to: Some([5.0, 2.0]),
            },
            // A place where something else started.
            Change::Move {
                object: 1,
                to: [2.0, 2.0],
            },
            Change::AddObject {
                at: [1.0, 2.5],
                goal: Some([4.0, 1.0]),
                like: 1,
            },
            Change::Close {
                corners: [3.0, 0.0, 3.2, 1.0],
            },
            Change::Open { at: [3.1, 2.0] },
            Change::AddRobot { at: [5.0, 0.5] },
        ];
        let version = room().changed(&changes).unwrap();
        let text = crate::to_canonical_toml(&version);
        let again = crate::parse_version(&text, "scenario.toml").unwrap();
        assert_eq!(again.hash, version.hash);
        assert_eq!(crate::to_canonical_toml(&again), text);
        assert_ne!(version.hash, room().hash);
        assert_eq!(version.objects[0].goal, None);
        assert_eq!(version.objects[1].goal, Some(Vec2::new(5.0, 2.0)));
        assert_eq!(version.objects[2].start, Vec2::new(1.0, 2.5));
        assert_eq!(version.homes[1..], [Vec2::new(5.0, 0.5)]);
        assert_eq!(version.draft().walls.len(), 1);
        assert_eq!(
            version.draft().walls[0],
            WallDraft::Box([3.0, 0.0, 3.2, 1.0])
        );
        // As the beginning of a run it would not do: two objects start at one place.
        crate::parse(&text, "scenario.toml").unwrap_err();
    }

    #[test]
    fn every_change_travels() {
        let changes = [
            Change::Goal {
                object: 7,
                to: None,
            },
            Change::Goal {
                object: 7,
                to: Some([1.0, -2.0]),
            },
            Change::Move {
                object: 3,
                to: [0.5, 0.25],
            },
            Change::AddObject {
                at: [1.0, 2.0],
                goal: None,
                like: 4,
            },
            Change::AddObject {
                at: [1.0, 2.0],
                goal: Some([3.0, 4.0]),
                like: 0,
            },
            Change::Close {
                corners: [1.0, 2.0, 3.0, 4.0],
            },
            Change::Open { at: [1.0, 2.0] },
            Change::AddRobot { at: [1.0, -2.0] },
        ];
        for change in changes {
            assert_eq!(Change::from_wire(&change.to_wire()), Some(change));
        }
        let unknown = SceneChange {
            kind: 99,
            ..SceneChange::default()
        };
        assert_eq!(Change::from_wire(&unknown), None);
    }

    #[test]
    fn what_cannot_be_is_told() {
        let cases: [(Change, &str); 11] = [
            (
                Change::Goal {
                    object: 2,
                    to: None,
                },
                "there is no object 2: the run has 2, counted from 0",
            ),
            (
                Change::Move {
                    object: 9,
                    to: [1.0, 1.0],
                },
                "there is no object 9",
            ),
            (
                Change::AddObject {
                    at: [1.0, 1.0],
                    goal: None,
                    like: 5,
                },
                "there is no object 5",
            ),
            (
                Change::Goal {
                    object: 0,
                    to: Some([3.0, 2.0]),
                },
                "objects[0].goal: the goal lies in wall 0",
            ),
            (
                Change::Goal {
                    object: 0,
                    to: Some([4.1, 2.0]),
                },
                "have overlapping goals",
            ),
            (
                Change::Close {
                    corners: [0.0, 0.0, 1.0, 1.0],
                },
                "robots[0].home: the home lies in wall 1",
            ),
            (
                Change::Open { at: [2.9, 2.0] },
                "0 walls cover the point 2.9, 2",
            ),
            (
                Change::AddRobot { at: [3.1, 2.0] },
                "robots[1].home: the home lies in wall 0",
            ),
            (
                Change::AddRobot { at: [5.9, 0.5] },
                "robots[1].home: the home lies partly or wholly outside the bounds",
            ),
            (
                Change::AddRobot { at: [0.9, 0.5] },
                "are blocked by one another",
            ),
            (
                Change::AddRobot { at: [5.0, 1.8] },
                "overlap: the run could never be complete",
            ),
        ];
        for (change, words) in cases {
            let error = room().changed(&[change]).unwrap_err().to_string();
            assert!(error.contains(words), "{error}");
        }
        let twice = Change::Close {
            corners: [2.9, 1.0, 3.1, 2.0],
        };
        let error = room()
            .changed(&[twice, Change::Open { at: [3.05, 1.5] }])
            .unwrap_err();
        assert!(error.to_string().starts_with("2 walls cover"), "{error}");
        let homes = (0..24).flat_map(|x| (0..24).map(move |y| (x, y)));
        let robots = homes.map(|(x, y)| Change::AddRobot {
            at: [0.5 + f64::from(x), 5.5 + f64::from(y)],
        });
        let robots: Vec<Change> = robots.take(MAX_ROBOTS).collect();
        let hall = ROOM.replace("6.0, 3.0]", "30.0, 30.0]");
        let hall = crate::parse(&hall, "hall").unwrap();
        hall.changed(&robots[1..]).unwrap();
        let error = hall.changed(&robots).unwrap_err().to_string();
        let words = format!("{} robots, over the capacity", MAX_ROBOTS + 1);
        assert!(error.contains(&words), "{error}");
    }
}

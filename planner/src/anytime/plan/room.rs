//! Sending robots elsewhere that are parked in the way of a move.
//!
//! Responsible for: who is in the way, and where they go.
//! Not responsible for: the move itself (the parent module).

use scene::ROBOT_ALONE;

use crate::anytime::ground::{Ground, Time};
use crate::anytime::plan::Plan;
use crate::anytime::route::{Piece, Router, Target};
use crate::anytime::track::{Move, Place};

impl Plan {
    /// As [`Self::commit`]; if parked robots are in the way, they go elsewhere first.
    pub(crate) fn commit_making_room(
        &mut self,
        ground: &mut Ground,
        router: &mut Router,
        wanted: &Move,
    ) -> Option<Time> {
        for _ in 0..2 * self.tracks.len() {
            if let Some(done) = self.commit(ground, router, wanted) {
                return Some(done);
            }
            let tail = self.take_tail(ground, wanted.robot);
            let clear = self.clear_from(ground, wanted.robot, &wanted.to);
            let mut legs = self.legs(ground, wanted, clear.unwrap_or(0));
            // Where it goes then is another matter.
            legs[2].target = Target::Anywhere(None);
            let mut way = std::mem::take(&mut self.way);
            let quest = self.quest(wanted, &legs, self.robots);
            let found = router.find(ground, &self.timeline, &quest, &mut way);
            let bodies = self.bodies(ground, wanted, &way);
            self.way = way;
            self.put_tail_back(ground, wanted.robot, tail);
            found?;
            let in_the_way = (0..self.tracks.len()).find(|&other| {
                let end = self.tracks[other].end.0;
                let meets = |&(cell, class): &(u32, usize)| ground.meet(class, cell, 0, end);
                let takes_part = other != wanted.robot && !self.tracks[other].is_gone;
                takes_part && (clear == Err(other) || bodies.iter().any(meets))
            })?;
            self.make_room(ground, router, in_the_way, &bodies, &wanted.to)?;
        }
        None
    }

    /// Where a way leads, and as which class.
    fn bodies(&self, ground: &Ground, wanted: &Move, way: &[Piece]) -> Vec<(u32, usize)> {
        let (mut cell, _) = self.tracks[wanted.robot].free;
        let mut class = ROBOT_ALONE.0;
        let mut bodies = vec![(cell, class)];
        for piece in way {
            match *piece {
                Piece::Step(direction, ..) => {
                    cell = cell.wrapping_add_signed(ground.offsets[direction as usize]);
                }
                Piece::Grip(_) if class == ROBOT_ALONE.0 => {
                    class = ground.carrying(wanted.object, wanted.to.by);
                }
                Piece::Grip(_) => class = ROBOT_ALONE.0,
            }
            bodies.push((cell, class));
        }
        bodies
    }

    /// Sends a parked robot to the nearest place that is in nobody's way and off these bodies'.
    fn make_room(
        &mut self,
        ground: &Ground,
        router: &mut Router,
        robot: usize,
        bodies: &[(u32, usize)],
        place: &Place,
    ) -> Option<Time> {
        let mut marks = vec![0; ground.points()];
        for &(cell, class) in bodies {
            let at = ground.xy(cell);
            for &offset in &ground.mask(ROBOT_ALONE.0, class).all {
                if let Some(near) = ground.moved(at, offset) {
                    marks[near as usize] = 1;
                }
            }
        }
        for &cell in place.cells[ROBOT_ALONE.0].iter().chain(place.bare.iter()) {
            marks[cell as usize] = 1;
        }
        self.go(ground, router, robot, Target::Anywhere(Some(marks.into())))
    }
}

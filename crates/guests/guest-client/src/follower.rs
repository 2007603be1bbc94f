//! Follower: pure pursuit along the route, as `guests/follower/follower.py`, to start a guest of your own from.
//!
//! Naive by intention: the newest fix is the place, and the last one stays the place when none comes any more. Obstacles, tracks,
//! teammates and the fence are left alone.
#![allow(clippy::disallowed_methods, reason = "a guest's own code is not held to the reproducibility of the cores")]

use std::collections::VecDeque;

use crate::{Fix, Guest, Own, Position, Reply, Start, Step};

const LOOKAHEAD_S: f64 = 0.9;
const LOOKAHEAD_M: (f64, f64) = (1.5, 4.0);
/// Largest curvature, 1/m.
const MAX_CURVATURE: f64 = 0.4;
/// Largest sideways acceleration in a curve, m/s².
const SIDEWAYS: f64 = 1.2;
/// Deceleration towards the goal, m/s².
const COMFORT: f64 = 1.0;
const REACHED_M: f64 = 0.8;

/// A follower of the route.
#[derive(Debug, Default)]
pub struct Follower {
    max_speed: f64,
    looped: bool,
    ahead: VecDeque<Position>,
    fix: Option<Fix>,
    speed: f64,
}

impl Guest for Follower {
    fn start(&mut self, start: Start) -> Result<(), Own> {
        self.max_speed = start.max_speed_m_s;
        self.looped = start.looped;
        self.ahead = start.route.into();
        Ok(())
    }

    fn step(&mut self, step: Step) -> Result<Reply, Own> {
        self.fix = step.fix.or(self.fix);
        let Some(Fix { at: here, yaw_rad, .. }) = self.fix else { return Ok(reply(0.0, 0.0, "WAITING", [0.0, 0.0])) };
        if self.ahead.front().is_some_and(|next| distance(here, *next) < REACHED_M) {
            let reached = self.ahead.pop_front();
            self.ahead.extend(reached.filter(|_| self.looped));
        }
        if self.ahead.is_empty() {
            return Ok(reply(0.0, 0.0, "ARRIVED", here));
        }
        let curvature = self.pursue(here, yaw_rad, step.limit_m_s.min(self.max_speed));
        Ok(reply(self.speed, curvature, "DRIVING", here))
    }
}

impl Follower {
    /// Curvature of the arc through the point at lookahead distance along the way. Sets the speed.
    fn pursue(&mut self, here: Position, yaw: f64, limit: f64) -> f64 {
        let reach = (self.speed * LOOKAHEAD_S).clamp(LOOKAHEAD_M.0, LOOKAHEAD_M.1);
        let (mut left, mut carrot, mut place) = (0.0, None, here);
        for &point in &self.ahead {
            let leg = distance(place, point);
            if carrot.is_none() && left + leg >= reach {
                let share = (reach - left) / leg;
                carrot = Some([place[0] + share * (point[0] - place[0]), place[1] + share * (point[1] - place[1])]);
            }
            left += leg;
            place = point;
        }
        let carrot = carrot.unwrap_or(place);
        let bearing = (carrot[1] - here[1]).atan2(carrot[0] - here[0]) - yaw;
        let arc = 2.0 * bearing.sin() / distance(here, carrot);
        // A point behind has a flat arc in this formula: the vehicle turns round as sharply as it can.
        let arc = if bearing.cos() < 0.0 { MAX_CURVATURE.copysign(arc) } else { arc };
        let curvature = arc.clamp(-MAX_CURVATURE, MAX_CURVATURE);
        let slow = (SIDEWAYS / curvature.abs().max(1e-9)).sqrt();
        let stop = if self.looped { f64::INFINITY } else { (2.0 * COMFORT * left).sqrt() };
        self.speed = limit.min(slow).min(stop);
        curvature
    }
}

fn distance(a: Position, b: Position) -> f64 {
    (b[0] - a[0]).hypot(b[1] - a[1])
}

fn reply(speed_m_s: f64, curvature_per_m: f64, state: &str, place: Position) -> Reply {
    Reply { speed_m_s, curvature_per_m, state: Some(state.to_owned()), place: Some(place), ..Reply::default() }
}

//! Timed motions: a path through configurations within the joints' speed limits.

use super::{Arm, Joints};
use serde::{Deserialize, Serialize};

/// Time in which a joint comes to its full speed, seconds: a path starts and ends at rest.
const RAMP_S: f64 = 0.15;
/// Stops that stand for each ramp.
const RAMP_STOPS: u32 = 4;

/// A configuration and when it is passed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Stop {
    /// Seconds since the motion began.
    pub at_s: f64,
    /// The configuration.
    pub joints: Joints,
}

/// A timed path: straight lines in joint space from stop to stop.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Motion {
    /// The stops, times ascending, the first at 0.
    pub stops: Vec<Stop>,
}

impl Motion {
    /// The fastest motion along a way within the joints' speeds in which the tool is not faster than `tool_m_s`; the
    /// whole comes up to speed and back to rest in `RAMP_S`.
    pub fn along(arm: &Arm, path: &[Joints], tool_m_s: f64) -> Self {
        let Some(first) = path.first() else { return Self::default() };
        let mut cruise = vec![0.0];
        let mut tip = arm.world_from_tool(first).translation.vector;
        let mut total = 0.0;
        for pair in path.windows(2) {
            let next = arm.world_from_tool(&pair[1]).translation.vector;
            total += arm.shortest_time_s(&pair[0], &pair[1]).max((next - tip).norm() / tool_m_s);
            tip = next;
            cruise.push(total);
        }
        // Speed rises and falls linearly at the ends, which takes a few stops more there.
        let cruise: Vec<Stop> = cruise.into_iter().zip(path).map(|(at_s, q)| Stop { at_s, joints: *q }).collect();
        let cruise = Self { stops: cruise };
        let ramp = 0.5 * RAMP_S.min(total);
        let within = |k: u32| ramp * (f64::from(k) / f64::from(RAMP_STOPS)).powi(2);
        let mut times: Vec<f64> = cruise.stops.iter().map(|stop| stop.at_s).collect();
        times.extend((1..=RAMP_STOPS).flat_map(|k| [within(k), total - within(k)]));
        times.sort_by(f64::total_cmp);
        times.dedup_by(|a, b| (*a - *b).abs() < 1e-9);
        let stop = |at: f64| cruise.at(at).map(|joints| Stop { at_s: ramped(at, total), joints });
        Self { stops: times.into_iter().filter_map(stop).collect() }
    }

    /// How long it takes, seconds.
    pub fn duration_s(&self) -> f64 {
        self.stops.last().map_or(0.0, |stop| stop.at_s)
    }

    /// The configuration at a time; before the start the first, after the end the last.
    pub fn at(&self, time_s: f64) -> Option<Joints> {
        let next = self.stops.partition_point(|stop| stop.at_s <= time_s);
        let Some(to) = self.stops.get(next) else { return self.stops.last().map(|stop| stop.joints) };
        let Some(from) = next.checked_sub(1).map(|at| &self.stops[at]) else { return Some(to.joints) };
        Some(from.joints.toward(&to.joints, (time_s - from.at_s) / (to.at_s - from.at_s)))
    }

    /// The same way back, just as fast.
    pub fn reversed(&self) -> Self {
        let end = self.duration_s();
        Self {
            stops: self.stops.iter().rev().map(|stop| Stop { at_s: end - stop.at_s, joints: stop.joints }).collect(),
        }
    }

    /// This motion and then another that begins where this one ends.
    pub fn then(mut self, other: &Self) -> Self {
        let end = self.duration_s();
        let skip = usize::from(!self.stops.is_empty());
        self.stops
            .extend(other.stops.iter().skip(skip).map(|stop| Stop { at_s: end + stop.at_s, joints: stop.joints }));
        self
    }

    /// The configurations, without their times.
    pub fn path(&self) -> impl DoubleEndedIterator<Item = Joints> + '_ {
        self.stops.iter().map(|stop| stop.joints)
    }
}

/// When a point is passed that would be passed at `at` at full speed, if a way of `total` seconds starts and ends at rest
/// with constant acceleration over [`RAMP_S`] at each end.
fn ramped(at: f64, total: f64) -> f64 {
    // Half of a ramp's time is lost at each end; a way too short for full speed ramps up to its middle.
    let ramp = RAMP_S.min(total.max(0.0));
    let rising = |distance: f64| (2.0 * distance * ramp).sqrt();
    if at <= 0.5 * ramp {
        rising(at)
    } else if at >= total - 0.5 * ramp {
        total + ramp - rising(total - at)
    } else {
        at + 0.5 * ramp
    }
}

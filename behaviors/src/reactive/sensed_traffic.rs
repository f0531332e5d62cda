//! Keeping apart from traffic that is only sensed: no message is sent or heard (D2.7
//! §1.2.3).
//!
//! Everybody holds the same contingency: a circle to the right for ever. Two that fly it
//! at one turn rate keep the distance of their centres less that of their phases, for the
//! one stands and the other turns as a whole. A UAV does something else for a moment only
//! if that distance, the [`clearance`](Rule::clearance_m) of the pair, stays enough even if
//! the other one meanwhile does the worst that it can; circling to the right changes nothing
//! and is always allowed. This is the generalised roundabout (Pallottino, Scordio, Bicchi,
//! Frazzoli: Decentralized cooperative policy for conflict resolution in multivehicle
//! systems, 2007) with phases: reserved discs may overlap where those in them are in step.
//!
//! What is wanted comes from prediction: the least deviation from the goal, to the right rather
//! than to the left, with which all keep each other's circles clear if all others fly straight
//! on. Asked is what the rule will allow: those who pass each other left to left need a
//! separation between them, right to right two diameters more.
//!
//! # Guarantees
//! Any number of UAVs that fly this rule, of which each senses all others within
//! [`Rule::least_range_m`], keep the separation for ever if [`Rule::has_escape`] holds for
//! all of them once, whatever they want and whenever each decides. Traffic that does not
//! fly the rule is avoided as long as prediction holds; of that nothing is promised.
//!
//! # Complexity
//! O(contacts · candidates), some three hundred arithmetic steps a contact.

use skein_geometry::Segment;
use skein_geometry::frame::{Point, Pose, Vector};
use skein_geometry::math::{TAU, atan2, sin_cos, wrap_pi};

/// Turn rates that differ by less are one, as a share.
const SAME_RATE: f64 = 1e-6;

/// Wanted courses beside that to the goal, in parts of a turn.
const COURSES: i32 = 72;

/// A degree to the left counts as so many to the right: nearly nobody evades to the left, so
/// that those who meet pass each other left to left, where circles to the right lie apart.
const LEFT_FACTOR: f64 = 20.0;

/// Meetings further ahead are left for later, seconds: by then others have turned.
const AHEAD_S: f64 = 30.0;

/// What is asked for on top of the separation between what two are predicted to keep clear for
/// their circles, as a share.
const ROOM: f64 = 0.4;

/// The same to who flies no rule, of whom nothing is known but where it flies now.
const ROOM_TO_OTHERS: f64 = 1.5;

/// A metre short of that costs as much as a deviation of so many radians.
const SHORT_RAD_PER_M: f64 = 0.1;

/// The part of the hardest turn that is flown to the left at most: what a UAV may do in a
/// moment is what all others have to leave room for.
const LEFT_MOST: f64 = 1.0;

/// The part of the spare clearance of a pair that one step may use: while it lasts the other
/// begins two steps at most, and half is left then.
const USED: f64 = 0.25;

/// Turn rates that are tried, in shares of the hardest turn, positive to the left.
const TRIED: [f64; 15] = [
    1.0, 0.75, 0.5, 0.375, 0.25, 0.125, 0.0, -0.125, -0.25, -0.375, -0.5, -0.625, -0.75, -0.875,
    -1.0,
];

/// An aircraft that is sensed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// Where it is.
    pub pose: Pose,
    /// Its airspeed, m/s.
    pub airspeed_mps: f64,
    /// Radius of its circle, metres; nothing for who does not fly this rule.
    pub circle_m: Option<f64>,
}

/// The rule for one UAV.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rule {
    /// Its airspeed, m/s.
    pub airspeed_mps: f64,
    /// Radius of its circle, metres.
    pub circle_m: f64,
    /// What has to stay between any two, metres.
    pub separation_m: f64,
    /// How far what is sensed and flown may be off, metres for a pair.
    pub errors_m: f64,
    /// Time from one decision to the next, seconds.
    pub step_s: f64,
}

impl Rule {
    /// The turn rate to fly until the next decision, rad/s, positive to the left.
    #[must_use]
    pub fn turn_rate_radps(&self, own: &Pose, goal: Point, contacts: &[Contact]) -> f64 {
        let hardest = self.airspeed_mps / self.circle_m;
        let course_rad = self.course_rad(own, goal, contacts);
        let wanted = wrap_pi(course_rad - own.heading_rad) / (hardest * self.step_s);
        let wanted = wanted.clamp(-1.0, LEFT_MOST);
        // The exact turn first: it ends on the course.
        let mut tried: Vec<f64> = std::iter::once(wanted).chain(TRIED).collect();
        tried.sort_by(|a, b| (a - wanted).abs().total_cmp(&(b - wanted).abs()));
        let allowed = tried.into_iter().find(|share| {
            let clear = |c: &Contact| self.is_allowed(own, *share * hardest, c);
            *share <= -1.0 || contacts.iter().all(clear)
        });
        allowed.unwrap_or(-1.0) * hardest
    }

    /// Whether all contacts that fly the rule leave room for this UAV's circle, and it for
    /// theirs.
    #[must_use]
    pub fn has_escape(&self, own: &Pose, contacts: &[Contact]) -> bool {
        contacts.iter().all(|c| {
            let needed_m = self.separation_m + self.errors_m;
            self.clearance_m(own, c).is_none_or(|m| m.abs() >= needed_m)
        })
    }

    /// Within this range others have to be sensed, metres: two who see each other only then
    /// have room for their circles, and for the worst of one step of each.
    #[must_use]
    pub fn least_range_m(&self, fastest_mps: f64, widest_m: f64) -> f64 {
        let circles_m = 2.0 * (self.circle_m + widest_m);
        let steps_m = 2.0 * (self.reach_m(self.airspeed_mps) + self.reach_m(fastest_mps));
        circles_m + self.separation_m + self.errors_m + steps_m
    }

    /// The least distance of a pair that circles to the right from now on, metres: positive
    /// where their circles lie apart, negative where one goes round within or along the
    /// other's; zero where circles of unlike turn rates cross. `None` for who does not fly the
    /// rule.
    #[must_use]
    pub fn clearance_m(&self, own: &Pose, contact: &Contact) -> Option<f64> {
        self.pair(own, contact).map(|p| p.clearance_m())
    }

    /// How far one step of a UAV can move the centre of its circle at most, metres: a turn of
    /// `u` hardest ones to the left moves it by (1 + u) V dt, and its phase by as much
    /// against one that circles.
    fn reach_m(&self, airspeed_mps: f64) -> f64 {
        (1.0 + LEFT_MOST) * airspeed_mps * self.step_s
    }

    /// Whether a step leaves the pair its clearance, whatever the other one does meanwhile:
    /// it may use a part of what there is beyond the separation, less what two steps at the
    /// same time take beyond what each takes by itself.
    fn is_allowed(&self, own: &Pose, rate_radps: f64, contact: &Contact) -> bool {
        let (Some(now), Some(circle_m)) = (self.pair(own, contact), contact.circle_m) else {
            return true;
        };
        // Whose circles cross at unlike rates has nothing to keep, and what is predicted decides.
        let before_m = now.clearance_m();
        if before_m.abs() <= 0.0 {
            return true;
        }
        let spare_m = before_m.abs() - self.separation_m - self.errors_m;
        let turn = |pose: &Pose, curvature_per_m: f64, length_m: f64| {
            let step = Segment {
                start: *pose,
                curvature_per_m,
                length_m,
            };
            step.pose_at(length_m)
        };
        [0.5, 1.0].into_iter().all(|share| {
            let own_m = share * self.airspeed_mps * self.step_s;
            let their_m = share * contact.airspeed_mps * self.step_s;
            let then = turn(own, rate_radps / self.airspeed_mps, own_m);
            // Who circles changes nothing, so against that a step is counted.
            let circled = Contact {
                pose: turn(&contact.pose, -1.0 / circle_m, their_m),
                ..*contact
            };
            let Some(after) = self.pair(&then, &circled) else {
                return true;
            };
            let after_m = after.clearance_m();
            let gained_m = after_m.abs() - before_m.abs();
            let moved_m = (after.own_centre - now.own_centre).norm();
            let theirs_m = self.reach_m(contact.airspeed_mps);
            let both_m = now.coupling_m(&after, moved_m, theirs_m);
            before_m * after_m > 0.0 && gained_m >= both_m - USED * spare_m
        })
    }

    fn pair(&self, own: &Pose, contact: &Contact) -> Option<Pair> {
        let circle_m = contact.circle_m?;
        let (own_centre, own_r) = circle(own, self.circle_m);
        let (their_centre, their_r) = circle(&contact.pose, circle_m);
        let in_step = self.is_in_step(contact.airspeed_mps, circle_m);
        Some(Pair {
            own_centre,
            centres_m: (their_centre - own_centre).norm(),
            phases_m: in_step.then(|| (their_r - own_r).norm()),
            radii_m: (self.circle_m, circle_m),
        })
    }

    /// The course with the least deviation from the goal on which nobody is met.
    fn course_rad(&self, own: &Pose, goal: Point, contacts: &[Contact]) -> f64 {
        let to = goal - own.position();
        let straight_rad = self.homing_rad(own, atan2(to.y, to.x), goal);
        let mut best = (f64::INFINITY, straight_rad);
        for (deviation, beside_rad) in courses() {
            if deviation >= best.0 {
                break;
            }
            let way = self.way(own, straight_rad + beside_rad);
            let short = contacts.iter().map(|c| self.short_m(&way, c));
            let cost = deviation + SHORT_RAD_PER_M * short.fold(0.0, f64::max);
            if cost < best.0 {
                best = (cost, straight_rad + beside_rad);
            }
        }
        best.1
    }

    /// What flying a course from now on does to the circle: while a UAV turns to the right it
    /// stands, while it turns to the left its centre goes round by two radii.
    fn way(&self, own: &Pose, course_rad: f64) -> Way {
        let turn_rad = wrap_pi(course_rad - own.heading_rad);
        let (begin, _) = circle(own, self.circle_m);
        let turned = Pose::new(own.position(), course_rad);
        let (_, phase) = circle(&turned, self.circle_m);
        let centre = if turn_rad > 0.0 {
            let d = own.direction();
            let round = own.position() + Vector::new(-d.y, d.x) * self.circle_m;
            let (s, c) = sin_cos(turn_rad);
            let w = begin - round;
            round + Vector::new(w.x * c - w.y * s, w.x * s + w.y * c)
        } else {
            begin
        };
        Way {
            from: own.position(),
            centre,
            phase,
            turning_s: turn_rad.abs() * self.circle_m / self.airspeed_mps,
            velocity: turned.direction() * self.airspeed_mps,
        }
    }

    /// The course towards a goal, or, where it lies within the turn that leads there, straight on
    /// until it does not: chased, it would be circled for ever.
    fn homing_rad(&self, own: &Pose, to_goal_rad: f64, goal: Point) -> f64 {
        let d = own.direction();
        let left = Vector::new(-d.y, d.x);
        let within = |radius_m: f64| {
            let centre = own.position() + left * radius_m;
            (goal - centre).norm() < radius_m.abs()
        };
        let is_left = wrap_pi(to_goal_rad - own.heading_rad) > 0.0;
        let inside = if is_left {
            within(self.circle_m / LEFT_MOST)
        } else {
            within(-self.circle_m)
        };
        if inside { own.heading_rad } else { to_goal_rad }
    }

    /// By how much the nearest predicted meeting is too near, metres.
    fn short_m(&self, way: &Way, contact: &Contact) -> f64 {
        let theirs = contact.pose.direction() * contact.airspeed_mps;
        let closing = theirs - way.velocity;
        let nearest_m = |apart: Vector| {
            let square = closing.norm_squared().max(f64::MIN_POSITIVE);
            let at_s = (-apart.dot(&closing) / square).clamp(0.0, AHEAD_S);
            (apart + closing * at_s).norm()
        };
        let (room, kept_m) = match contact.circle_m {
            Some(radius_m) => {
                let (centre, phase) = circle(&contact.pose, radius_m);
                let in_step = self.is_in_step(contact.airspeed_mps, radius_m);
                let between_m = if in_step {
                    (phase - way.phase).norm()
                } else {
                    self.circle_m + radius_m
                };
                let apart = centre + theirs * way.turning_s - way.centre;
                (ROOM, nearest_m(apart) - between_m)
            }
            None => (
                ROOM_TO_OTHERS,
                nearest_m(contact.pose.position() - way.from),
            ),
        };
        ((1.0 + room) * self.separation_m - kept_m).max(0.0)
    }

    /// Whether who flies a circle so turns as fast as this UAV.
    fn is_in_step(&self, airspeed_mps: f64, circle_m: f64) -> bool {
        let own_rate = self.airspeed_mps / self.circle_m;
        (own_rate - airspeed_mps / circle_m).abs() <= SAME_RATE * own_rate
    }
}

/// What a course costs by itself and how far it is beside the wanted one, radians, to the left
/// where positive: what costs least first, of the same cost the one to the right.
fn courses() -> impl Iterator<Item = (f64, f64)> {
    let beside_rad = |k: i32| TAU * f64::from(k) / f64::from(COURSES);
    let right = (0..=COURSES / 2).map(move |k| beside_rad(-k));
    let mut right = right.map(|beside_rad| (-beside_rad, beside_rad)).peekable();
    let left = (1..=COURSES / 2).map(beside_rad);
    let mut left = left
        .map(|beside_rad| (LEFT_FACTOR * beside_rad, beside_rad))
        .peekable();
    core::iter::from_fn(move || match (right.peek(), left.peek()) {
        (Some(r), Some(l)) if r.0 > l.0 => left.next(),
        (Some(_), _) => right.next(),
        (None, _) => left.next(),
    })
}

/// A course, and what it does to the circle to the right.
struct Way {
    from: Point,
    /// Centre of the circle, and the way from there to the UAV, once it has turned.
    centre: Point,
    phase: Vector,
    turning_s: f64,
    velocity: Vector,
}

/// Two circles to the right.
struct Pair {
    own_centre: Point,
    centres_m: f64,
    /// How far their phases are apart; nothing where they turn at unlike rates.
    phases_m: Option<f64>,
    radii_m: (f64, f64),
}

impl Pair {
    fn clearance_m(&self) -> f64 {
        let (a_m, b_m) = self.radii_m;
        let nested_m = (a_m - b_m).abs() - self.centres_m;
        match self.phases_m {
            Some(phases_m) => self.centres_m - phases_m,
            None if nested_m > 0.0 => -nested_m,
            // Where circles of unlike rates cross there is none.
            None => (self.centres_m - a_m - b_m).max(0.0),
        }
    }

    /// By how much steps of both that move centres by so much can take more than each does by
    /// itself, metres; `after` is what the own one does by itself. A length turns by the one
    /// while it changes by the other, and never changes by more than the own step is long:
    /// |p + a - b| <= |p - b| + |a|.
    fn coupling_m(&self, after: &Self, own_m: f64, their_m: f64) -> f64 {
        let of = |length_m: f64, taken_m: f64| {
            let least_m = (length_m - own_m - their_m).max(f64::MIN_POSITIVE);
            let turned_m = own_m * their_m / least_m;
            turned_m.min((own_m - taken_m).max(0.0)).min(2.0 * their_m)
        };
        // What lets circles come together: that centres do and phases part, or the other way
        // round where one goes round the other.
        let sense = self.clearance_m().signum();
        let nearer_m = sense * (self.centres_m - after.centres_m);
        let phases_m = match (self.phases_m, after.phases_m) {
            (Some(now_m), Some(then_m)) => of(now_m, sense * (then_m - now_m)),
            _ => 0.0,
        };
        of(self.centres_m, nearer_m) + phases_m
    }
}

/// Centre of the circle to the right, and the way from it to the UAV.
fn circle(pose: &Pose, radius_m: f64) -> (Point, Vector) {
    let d = pose.direction();
    let right = Vector::new(d.y, -d.x) * radius_m;
    (pose.position() + right, -right)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use skein_geometry::random::SplitMix64;

    fn rule() -> Rule {
        Rule {
            airspeed_mps: 20.0,
            circle_m: 75.0,
            separation_m: 50.0,
            errors_m: 4.0,
            step_s: 0.2,
        }
    }

    fn contact(pose: Pose, airspeed_mps: f64, circle_m: f64) -> Contact {
        Contact {
            pose,
            airspeed_mps,
            circle_m: Some(circle_m),
        }
    }

    fn circled(pose: Pose, airspeed_mps: f64, circle_m: f64, after_s: f64) -> Point {
        let piece = Segment {
            start: pose,
            curvature_per_m: -1.0 / circle_m,
            length_m: airspeed_mps * after_s,
        };
        piece.end().position()
    }

    fn any_pose() -> impl Strategy<Value = Pose> {
        (-300.0..300.0, -300.0..300.0, -3.1..3.1)
            .prop_map(|(x, y, h)| Pose::new(Point::new(x, y), h))
    }

    #[test]
    fn courses_are_tried_once_each_and_the_cheapest_first() {
        let all: Vec<(f64, f64)> = courses().collect();
        assert_eq!(all.len(), 73);
        assert!(all.windows(2).all(|w| w[0].0 <= w[1].0), "{all:?}");
        let mut beside: Vec<f64> = all.iter().map(|(_, beside_rad)| *beside_rad).collect();
        beside.sort_by(f64::total_cmp);
        beside.dedup();
        assert_eq!(beside.len(), 73);
    }

    proptest! {
        /// Circles never come nearer than the clearance says, and in step just so near.
        #[test]
        fn clearance_is_what_circles_keep(a in any_pose(), b in any_pose(), unlike in any::<bool>()) {
            let (mps, radius_m) = if unlike { (16.0, 48.0) } else { (20.0, 75.0) };
            let told_m = rule().clearance_m(&a, &contact(b, mps, radius_m)).unwrap().abs();
            let mut nearest_m = f64::INFINITY;
            for k in 0..3_000 {
                let at_s = f64::from(k) * 0.05;
                let apart = circled(a, 20.0, 75.0, at_s) - circled(b, mps, radius_m, at_s);
                nearest_m = nearest_m.min(apart.norm());
            }
            prop_assert!(nearest_m >= told_m - 1e-6, "{nearest_m} {told_m}");
            if !unlike {
                // Between two looks, a twentieth of a second apart, they move by two metres against
                // each other at most, and by one from the nearer one.
                prop_assert!(nearest_m <= told_m.hypot(1.0) + 0.1, "{nearest_m} {told_m}");
            }
        }

        /// Whatever two want and whenever each decides, they keep the separation.
        #[test]
        fn two_keep_apart(a in any_pose(), b in any_pose(), goals in (any_pose(), any_pose()), late in 0_usize..4) {
            let rule = rule();
            let mut poses = [a, b];
            let goals = [goals.0.position(), goals.1.position()];
            prop_assume!(rule.has_escape(&a, &[contact(b, 20.0, 75.0)]));
            let mut rates = [-20.0 / 75.0; 2];
            for step in 0..2_400_usize {
                for i in 0..2 {
                    if step % 4 == i * late {
                        let other = contact(poses[1 - i], 20.0, 75.0);
                        rates[i] = rule.turn_rate_radps(&poses[i], goals[i], &[other]);
                    }
                }
                for i in 0..2 {
                    let moved = Segment {
                        start: poses[i],
                        curvature_per_m: rates[i] / 20.0,
                        length_m: 1.0,
                    };
                    poses[i] = moved.end();
                }
                let apart_m = (poses[1].position() - poses[0].position()).norm();
                prop_assert!(apart_m >= 50.0, "{apart_m} m in step {step}");
            }
        }
    }

    /// Two abreast whose circles cross, the rates of which differ by a millionth: they were held
    /// to have room, and kept their circles crossing for ever (pair 20306790 of `bench conflicts`).
    #[test]
    fn circles_that_cross_at_unlike_rates_are_no_room_and_are_left() {
        let faster = Rule {
            airspeed_mps: 20.000_03,
            ..rule()
        };
        let rules = [rule(), faster];
        let mut poses = [
            Pose::new(Point::new(0.0, 0.0), 0.0),
            Pose::new(Point::new(-10.0, 90.0), 0.1),
        ];
        let sensed = |pose: Pose, of: &Rule| contact(pose, of.airspeed_mps, of.circle_m);
        let other = sensed(poses[1], &rules[1]);
        assert!(!rules[0].has_escape(&poses[0], &[other]));
        assert!(rules[0].clearance_m(&poses[0], &other).unwrap().abs() < 1e-9);
        let goals = [Point::new(900.0, -300.0), Point::new(900.0, 400.0)];
        let mut nearest_m = f64::INFINITY;
        for _ in 0..400 {
            for i in 0..2 {
                let other = sensed(poses[1 - i], &rules[1 - i]);
                let rate = rules[i].turn_rate_radps(&poses[i], goals[i], &[other]);
                let step = Segment {
                    start: poses[i],
                    curvature_per_m: rate / 20.0,
                    length_m: 4.0,
                };
                poses[i] = step.end();
            }
            nearest_m = nearest_m.min((poses[1].position() - poses[0].position()).norm());
        }
        let other = sensed(poses[1], &rules[1]);
        let left_m = rules[0].clearance_m(&poses[0], &other).unwrap();
        assert!(nearest_m >= 50.0 && left_m > 0.0, "{nearest_m} {left_m}");
    }

    /// Six in a narrow place who want something else all the time keep the separation and what
    /// is allowed for errors.
    #[test]
    fn many_keep_apart_whatever_they_want() {
        let rule = rule();
        let mut random = SplitMix64::new(1);
        let mut draw = |most: f64| most * (2.0 * random.unit() - 1.0);
        let mut poses: Vec<Pose> = Vec::new();
        while poses.len() < 6 {
            let pose = Pose::new(Point::new(draw(250.0), draw(250.0)), draw(3.1));
            let begun: Vec<Contact> = poses.iter().map(|p| contact(*p, 20.0, 75.0)).collect();
            if rule.has_escape(&pose, &begun) {
                poses.push(pose);
            }
        }
        let mut goals = vec![Point::new(0.0, 0.0); poses.len()];
        let mut rates = vec![-20.0 / 75.0; poses.len()];
        let mut nearest_m = f64::INFINITY;
        for step in 0..6_000_usize {
            for i in 0..poses.len() {
                if step % 4 != i % 4 {
                    continue;
                }
                if draw(1.0) > 0.9 {
                    goals[i] = Point::new(draw(500.0), draw(500.0));
                }
                let others = poses.iter().enumerate().filter(|(j, _)| *j != i);
                let others: Vec<Contact> = others.map(|(_, p)| contact(*p, 20.0, 75.0)).collect();
                rates[i] = rule.turn_rate_radps(&poses[i], goals[i], &others);
            }
            for (pose, rate) in poses.iter_mut().zip(&rates) {
                let moved = Segment {
                    start: *pose,
                    curvature_per_m: rate / 20.0,
                    length_m: 1.0,
                };
                *pose = moved.end();
            }
            for (i, a) in poses.iter().enumerate() {
                for b in &poses[..i] {
                    nearest_m = nearest_m.min((a.position() - b.position()).norm());
                }
            }
        }
        // They do come near each other, or nothing was tried.
        assert!((54.0..60.0).contains(&nearest_m), "{nearest_m}");
    }

    #[test]
    fn alone_it_flies_to_its_goal() {
        let rule = rule();
        let mut pose = Pose::new(Point::new(0.0, 0.0), 0.0);
        // Beside it, within the turn: chased, it would be circled.
        let goal = Point::new(0.0, 60.0);
        let arrives = (0..1_000).any(|_| {
            let rate = rule.turn_rate_radps(&pose, goal, &[]);
            let step = Segment {
                start: pose,
                curvature_per_m: rate / 20.0,
                length_m: 4.0,
            };
            pose = step.end();
            (pose.position() - goal).norm() < 10.0
        });
        assert!(arrives);
    }

    #[test]
    fn who_flies_no_rule_is_passed_on_the_right() {
        let rule = rule();
        let own = Pose::new(Point::new(0.0, 0.0), 0.0);
        let other = Contact {
            pose: Pose::new(Point::new(400.0, 0.0), TAU / 2.0),
            airspeed_mps: 20.0,
            circle_m: None,
        };
        let rate = rule.turn_rate_radps(&own, Point::new(900.0, 0.0), &[other]);
        assert!(rate < 0.0, "{rate}");
    }
}

//! What truly happened: cells seen, zones entered, separation (D2.7 §3.6, §2.3.1).
//!
//! The judge follows the flown pieces themselves, not reports, and uses only the
//! world's own geometry.

use super::board::Board;
use super::camera::Eye;
use super::fact::{Approach, Fact};
use super::ground::{Ground, GroundSeen};
use super::layers::LayerSeen;
use super::motion::{Kinematic, Piece};
use super::no_fly::{TurnAway, Zones};
use super::obstacles::{Obstacles, Place};
use super::pieces::Pieces;
use super::separation::Separation;
use super::survey::Survey;
use super::task_board::TaskBoard;
use skein_flight::coverage::ring::CellId;
use skein_geometry::frame::Point;
use std::collections::BTreeSet;
use std::sync::Arc;

pub use super::board::Sighting;

/// Follows all airframes and keeps the score.
#[derive(Clone, Debug)]
pub struct Judge {
    /// One for each mission so far: who follows an older one yet is judged by it.
    boards: Vec<Board>,
    zones: Zones,
    separation: Separation,
    tasks: TaskBoard,
    ground: Option<Ground>,
}

impl Judge {
    /// A judge who has seen nothing yet.
    #[must_use]
    pub fn new(survey: Arc<Survey>) -> Self {
        Self {
            zones: Zones::new(survey.zones()),
            separation: Separation::default(),
            tasks: TaskBoard::default(),
            ground: None,
            boards: vec![Board::new(0, survey)],
        }
    }

    /// Wants everything to be seen so many times, one lap after the other.
    #[must_use]
    pub fn with_laps(mut self, laps: u16) -> Self {
        self.board_mut().begin_at(0, laps.saturating_sub(1));
        self
    }

    /// What was seen is looked at again, as long as the mission goes on.
    #[must_use]
    pub fn with_watch(mut self, goes_round: bool) -> Self {
        if goes_round {
            self.board_mut().watch_again();
        }
        self
    }

    /// Takes note of how much of this ground is in sight.
    #[must_use]
    pub fn with_ground(mut self, ground: Option<Ground>) -> Self {
        self.ground = ground;
        self
    }

    /// From now on this ground is to be seen; what of it was seen counts.
    pub fn revise_ground(&mut self, mut ground: Option<Ground>) {
        if let (Some(new), Some(old)) = (&mut ground, &self.ground) {
            new.remember(old);
        }
        self.ground = ground;
    }

    /// What is on the ground is looked at from a UAV.
    pub fn look_at_ground(&mut self, body: &Kinematic, obstacles: &Obstacles) {
        if let Some(ground) = &mut self.ground {
            ground.look(body, obstacles);
        }
    }

    /// How much of the open ground was in sight; none where no buildings stand, or no area is to
    /// be seen.
    #[must_use]
    pub fn ground_seen(&self) -> Option<GroundSeen> {
        self.ground.as_ref().map(Ground::seen)
    }

    /// What came of each lap that is flown in a layer, by the true heights of who looked; nothing
    /// where all is flown at one.
    #[must_use]
    pub fn layers(&self) -> Vec<LayerSeen> {
        self.board().layers()
    }

    fn board(&self) -> &Board {
        &self.boards[self.boards.len() - 1]
    }

    fn board_mut(&mut self) -> &mut Board {
        let last = self.boards.len() - 1;
        &mut self.boards[last]
    }

    /// The longest time between the first sightings of a cell in one lap and the next, or between
    /// two visits where the mission goes on once everything is seen, milliseconds; none where
    /// everything is seen once.
    #[must_use]
    pub fn longest_gap_ms(&self) -> Option<u64> {
        self.board().longest_gap_ms()
    }

    /// The longest time between two visits of a cell that began at a time or later, milliseconds;
    /// none where no mission goes on once everything is seen.
    #[must_use]
    pub fn watched_gap_ms(&self, from_ms: u64) -> Option<u64> {
        self.board().watched_gap_ms(from_ms)
    }

    /// Watches these pieces besides, so that what peers claim to have seen can be
    /// checked where the survey knows other cells than they do.
    #[must_use]
    pub fn with_claims(mut self, pieces: Option<Arc<Pieces>>) -> Self {
        self.board_mut().watch_claims(pieces);
        self
    }

    /// From now on what another revision of the mission asks for is to be seen in this lap,
    /// from 0, and in so many further ones, or again and again where the mission goes on once
    /// everything is seen, and its zones are to be kept clear of. What was
    /// seen of the same places in this lap, or in a later one, counts.
    /// A zone that is new binds a UAV from the first moment in which it follows the revision and
    /// can still turn away. Peers that follow an older revision yet are judged by that.
    pub fn revise(
        &mut self,
        wanted: Arc<Survey>,
        (claims, lap, further_laps, goes_round): (Option<Arc<Pieces>>, u16, u16, bool),
        revision: u32,
        turn: TurnAway,
    ) {
        self.zones.revise(wanted.zones(), revision, turn);
        let mut board = Board::new(revision, wanted);
        board.watch_claims(claims);
        board.begin_at(lap, further_laps);
        if goes_round {
            board.watch_again();
        }
        for old in self.boards.iter().rev() {
            board.remember(old);
        }
        board.next_lap();
        self.boards.push(board);
    }

    /// Some follow another mission than the newest, which nobody else was told of: what they see of
    /// it counts.
    pub fn follow_beside(
        &mut self,
        wanted: Arc<Survey>,
        claims: Option<Arc<Pieces>>,
        (lap, further_laps): (u16, u16),
        revision: u32,
    ) {
        let mut board = Board::new(revision, wanted);
        board.watch_claims(claims);
        board.begin_at(lap, further_laps);
        for old in self.boards.iter().rev() {
            board.remember(old);
        }
        board.next_lap();
        self.boards.insert(self.boards.len() - 1, board);
    }

    /// Whether a camera saw what peers that follow this revision call this cell, in that
    /// many laps: in one of the missions of that number, where several were found.
    #[must_use]
    pub fn saw(&self, revision: u32, cell: CellId, laps: u16) -> bool {
        let known = self.boards.iter().map(Board::revision);
        let newest = known.filter(|r| *r <= revision).max();
        let mut boards = self.boards.iter();
        boards.any(|b| Some(b.revision()) == newest && b.saw(cell, laps))
    }

    /// A number that grows whenever [`Judge::saw`] may answer otherwise than before.
    #[must_use]
    pub fn version(&self) -> u64 {
        self.boards.iter().map(|b| b.marks() + 1).sum()
    }

    /// Whether another revision than the first is followed.
    #[must_use]
    pub fn is_revised(&self) -> bool {
        self.boards.len() > 1
    }

    /// The cells and which of them can be seen.
    #[must_use]
    pub fn survey(&self) -> &Survey {
        self.board().survey()
    }

    /// Who saw a cell first and when, if anybody did.
    #[must_use]
    pub fn sighting(&self, cell: CellId) -> Option<Sighting> {
        self.board().sighting(cell)
    }

    /// All cells of the mission with their first sightings, in the survey's order.
    pub fn sightings(&self) -> impl Iterator<Item = (CellId, Option<Sighting>)> + '_ {
        self.board().sightings()
    }

    /// Number of coverable cells seen.
    #[must_use]
    pub fn n_covered(&self) -> usize {
        self.board().n_covered()
    }

    /// Share of the coverable cells that were seen, 0 to 1; 1 when there are none.
    #[must_use]
    pub fn covered_share(&self) -> f64 {
        self.board().covered_share()
    }

    /// A mission ended by its time: nothing is to be seen after the last lap that is complete.
    /// Returns whether there is one.
    pub fn end_laps(&mut self) -> bool {
        self.board_mut().end_laps()
    }

    /// Whether every coverable cell was seen.
    #[must_use]
    pub fn complete(&self) -> bool {
        self.board().complete()
    }

    /// How often a UAV entered a no-fly zone.
    #[must_use]
    pub fn entries(&self) -> usize {
        self.zones.entries()
    }

    /// The closest approach so far.
    #[must_use]
    pub fn closest(&self) -> Option<Approach> {
        self.separation.closest()
    }

    /// Judges one flown piece of a UAV.
    pub fn watch<'a>(
        &mut self,
        uav: u16,
        eye: impl Into<Eye<'a>>,
        piece: &Piece,
        facts: &mut Vec<Fact>,
    ) {
        let eye = &eye.into();
        let last = self.boards.len() - 1;
        for (i, board) in self.boards.iter_mut().enumerate() {
            // What of an older mission is seen is no news.
            let mut old = Vec::new();
            let told = if i == last { &mut *facts } else { &mut old };
            board.look(uav, eye, piece, told);
        }
        self.zones.watch(uav, piece, facts);
        self.tasks.look(uav, eye, piece);
    }

    /// A task, by number and revision, is to be seen by one of these UAVs since then, milliseconds,
    /// of what is past as far as looks are kept; asked twice it is asked once.
    pub fn ask(
        &mut self,
        task: (u16, u32),
        pieces: Vec<[Point; 4]>,
        carriers: BTreeSet<u16>,
        since_ms: u64,
    ) {
        self.tasks.ask(task, pieces, carriers, since_ms);
    }

    /// Tasks are heard of so late at most, milliseconds, from now on.
    pub fn keep_looks(&mut self, keeps_ms: u64) {
        self.tasks.keep_looks(keeps_ms);
    }

    /// Who saw the last of a task and when, if all of it was seen since it was asked for.
    #[must_use]
    pub fn saw_task(&self, task: (u16, u32)) -> Option<Sighting> {
        self.tasks.saw(task)
    }

    /// A UAV follows this revision of the mission.
    pub fn follows(&mut self, uav: u16, revision: u32) {
        self.zones.follows(uav, revision);
    }

    /// Compares all airborne UAVs at one moment; `limit_m` is the separation below
    /// which an approach becomes a fact, once until the two part again.
    pub fn separate(
        &mut self,
        at_ms: u64,
        airborne: &[(u16, Place)],
        limit_m: f64,
        facts: &mut Vec<Fact>,
    ) {
        self.separation.observe(at_ms, airborne, limit_m, facts);
    }

    /// A new airframe under an old number begins outside all zones' memory.
    pub fn forget_position(&mut self, uav: u16) {
        self.zones.forget_position(uav);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::camera::Camera;
    use crate::world::fixture::{airframe, polygon, square};
    use skein_flight::airframe::Airframe;
    use skein_flight::mount::Mount;
    use skein_geometry::frame::Pose;
    use skein_peer::mission::PointMm;
    use skein_peer::{CoverageTask, PointTask};

    fn piece(x: f64, y: f64, heading: f64, ms: u64, rate: f64) -> Piece {
        Piece {
            from_ms: 1000,
            to_ms: 1000 + ms,
            start: Pose {
                east_m: x,
                north_m: y,
                heading_rad: heading,
            },
            speed_mps: 13.0,
            turn_rate_radps: rate,
            wind: skein_flight::trajectory::wind::Wind::CALM,
        }
    }

    fn turn() -> TurnAway {
        TurnAway::of(&square(1).mission)
    }

    fn judge_with(zones: &[&[(i32, i32)]]) -> Judge {
        let mut spec = square(1);
        spec.zones = zones.iter().map(|z| polygon(z)).collect();
        Judge::new(Arc::new(Survey::new(&spec)))
    }

    /// The fixture's scenario with an area of fewer lanes and one zone instead of its own.
    fn revised(east_mm: i32, zone: &[(i32, i32)]) -> Arc<Survey> {
        let mut spec = square(1);
        let mut mission = (*spec.mission).clone();
        mission.area = vec![(0, 0), (east_mm, 0), (east_mm, 384_000), (0, 384_000)];
        mission.zones = vec![zone.to_vec()];
        spec.zones = vec![polygon(zone)];
        spec.mission = Arc::new(mission);
        Arc::new(Survey::new(&spec))
    }

    #[test]
    fn a_revision_changes_what_is_to_be_seen_and_forgets_no_sighting() {
        let mut judge = judge_with(&[]);
        let mut facts = Vec::new();
        // Along the lowest lane, over cells inside the new area and beyond it.
        judge.watch(
            1,
            &airframe(),
            &piece(20.0, 24.0, 0.0, 30_000, 0.0),
            &mut facts,
        );
        let before = judge.n_covered();
        let far = (5_000_000, 5_000_000);
        let zone = [far, (far.0 + 9_000, far.1), (far.0, far.1 + 9_000)];
        assert!(!judge.is_revised());
        judge.revise(revised(240_000, &zone), (None, 0, 0, false), 2, turn());
        assert!(judge.is_revised());
        assert_eq!(judge.survey().cells().len(), 40);
        assert!(judge.n_covered() >= 4 && judge.n_covered() < before);
        assert!(judge.saw(1, CellId { col: 7, row: 0 }, 1), "seen before");
        judge.watch(
            1,
            &airframe(),
            &piece(20.0, 72.0, 0.0, 30_000, 0.0),
            &mut facts,
        );
        assert!(
            judge.saw(1, CellId { col: 7, row: 1 }, 1),
            "peers may not know yet"
        );
        assert_eq!(judge.n_covered(), 10);
        assert!(!judge.complete());
    }

    #[test]
    fn an_area_beyond_the_first_one_is_judged_and_so_are_those_who_fly_the_first() {
        let mut judge = judge_with(&[]);
        let mut spec = square(1);
        let mut mission = (*spec.mission).clone();
        mission.area = vec![
            (240_000, 0),
            (720_000, 0),
            (720_000, 384_000),
            (240_000, 384_000),
        ];
        spec.mission = Arc::new(mission);
        let row = piece(20.0, 24.0, 0.0, 54_000, 0.0);
        let (first, both, new) = ((2, 0), (7, 0), (12, 0));
        let id = |(col, row)| CellId { col, row };
        judge.watch(
            1,
            &airframe(),
            &piece(320.0, 24.0, 0.0, 4_000, 0.0),
            &mut Vec::new(),
        );
        judge.revise(Arc::new(Survey::new(&spec)), (None, 0, 0, false), 2, turn());
        let before = judge.n_covered();
        assert!(before > 0 && judge.saw(2, id(both), 1) && !judge.saw(2, id(new), 1));
        let mut facts = Vec::new();
        judge.watch(1, &airframe(), &row, &mut facts);
        assert!(judge.saw(1, id(first), 1) && judge.saw(2, id(new), 1));
        assert!(!judge.saw(1, id(new), 1) && !judge.saw(2, id(first), 1));
        assert_eq!(judge.n_covered(), 10);
        assert_eq!(
            facts.len(),
            10 - before,
            "news of the mission of today alone"
        );
    }

    fn places(points: &[PointMm]) -> Arc<Survey> {
        let mut spec = square(1);
        let mut mission = (*spec.mission).clone();
        let point = |at: &PointMm| PointTask {
            at: *at,
            radius_mm: 1_000,
        };
        mission.task = CoverageTask::Points(points.iter().map(point).collect());
        spec.mission = Arc::new(mission);
        Arc::new(Survey::new(&spec))
    }

    /// A change in the second lap of a patrol: what was seen in the first counts for that one
    /// alone, and a place that is new was not to be seen before.
    #[test]
    fn a_patrol_that_is_changed_goes_on_with_its_lap() {
        let (a, b, c) = ((100_000, 24_000), (100_000, 240_000), (300_000, 240_000));
        let mut judge = Judge::new(places(&[a, b])).with_laps(3);
        let fly = |judge: &mut Judge, north_m: f64| {
            let along = piece(40.0, north_m, 0.0, 10_000, 0.0);
            judge.watch(1, &airframe(), &along, &mut Vec::new());
        };
        // The place that ends a lap is seen again in the next one from where it was seen.
        for north_m in [240.0, 24.0] {
            fly(&mut judge, north_m);
        }
        judge.revise(places(&[c, b, a]), (None, 1, 1, false), 2, turn());
        let saw = |j: &Judge, n, laps| j.saw(2, CellId::numbered(n), laps);
        for (n, times) in [(0, 1), (1, 1), (2, 2)] {
            assert!(saw(&judge, n, times) && !saw(&judge, n, times + 1), "{n}");
        }
        // Who is told of the lap before sees all of that one for seen.
        judge.revise(places(&[b, a]), (None, 0, 2, false), 3, turn());
        assert!(saw(&judge, 1, 1) && !judge.complete());
        for north_m in [24.0, 240.0, 24.0] {
            assert!(!judge.complete());
            fly(&mut judge, north_m);
        }
        assert!(judge.complete());
    }

    #[test]
    fn of_other_targets_what_was_seen_of_the_same_places_counts_whatever_their_numbers() {
        let (a, b, c) = ((100_000, 24_000), (200_000, 240_000), (300_000, 240_000));
        let mut judge = Judge::new(places(&[a, b]));
        let over_a = piece(40.0, 24.0, 0.0, 10_000, 0.0);
        judge.watch(1, &airframe(), &over_a, &mut Vec::new());
        let saw = |j: &Judge, revision, n| j.saw(revision, CellId::numbered(n), 1);
        assert!(saw(&judge, 1, 0) && !saw(&judge, 1, 1));
        judge.revise(places(&[c, a]), (None, 0, 0, false), 2, turn());
        assert!(!saw(&judge, 2, 0) && saw(&judge, 2, 1) && saw(&judge, 1, 0));
        // Of laps the first is over for what was seen in any.
        judge.revise(places(&[a]), (None, 0, 1, false), 3, turn());
        assert!(!judge.complete());
        judge.watch(1, &airframe(), &over_a, &mut Vec::new());
        assert!(judge.complete());
    }

    #[test]
    fn a_new_zone_binds_whoever_knows_of_it_and_has_room_to_turn_away() {
        let block = [
            (225_000, 225_000),
            (255_000, 225_000),
            (255_000, 255_000),
            (225_000, 255_000),
        ];
        let over = piece(40.0, 240.0, 0.0, 20_000, 0.0);
        for (told, from_m, entries) in [(true, 40.0, 1), (false, 40.0, 0), (true, 200.0, 0)] {
            let mut judge = judge_with(&[]);
            judge.revise(revised(480_000, &block), (None, 0, 0, false), 2, turn());
            judge.follows(1, if told { 2 } else { 1 });
            let mut facts = Vec::new();
            let steps = (0..20).map(|k| Piece {
                start: Pose {
                    east_m: from_m + 13.0 * f64::from(k),
                    ..over.start
                },
                to_ms: over.from_ms + 1000,
                ..over
            });
            steps.for_each(|p| judge.zones.watch(1, &p, &mut facts));
            assert_eq!(judge.entries(), entries, "told {told}, from {from_m} m");
        }
        // What was lifted binds nobody.
        let mut judge = judge_with(&[&block]);
        let elsewhere = [(0, 0), (9_000, 0), (0, 9_000)];
        judge.revise(revised(480_000, &elsewhere), (None, 0, 0, false), 2, turn());
        judge.zones.watch(1, &over, &mut Vec::new());
        assert_eq!(judge.entries(), 0);
        // Nor does it when it comes back, before it is known again.
        judge.follows(1, 2);
        judge.revise(revised(480_000, &block), (None, 0, 0, false), 3, turn());
        judge.zones.watch(1, &over, &mut Vec::new());
        assert_eq!(judge.entries(), 0);
        judge.follows(1, 3);
        let far = Piece {
            start: Pose {
                east_m: -500.0,
                ..over.start
            },
            to_ms: over.from_ms + 1000,
            ..over
        };
        judge.zones.watch(1, &far, &mut Vec::new());
        judge.zones.watch(1, &over, &mut Vec::new());
        assert_eq!(judge.entries(), 1);
    }

    /// All corners of a cell in the turned rectangle, looked at every 2 cm.
    fn oracle(p: &Piece, ids: &[CellId]) -> Vec<bool> {
        let mut seen = vec![false; ids.len()];
        let n = (p.length_m() / 0.02).ceil() as u32;
        for k in 0..=n {
            let pose =
                p.pose_after((p.to_ms - p.from_ms) as f64 / 1000.0 * f64::from(k) / f64::from(n));
            let f = pose.direction();
            for (id, seen) in ids.iter().zip(&mut seen).filter(|(_, seen)| !**seen) {
                *seen = [(0, 0), (1, 0), (1, 1), (0, 1)].iter().all(|(i, j)| {
                    let c = Point::new(f64::from(id.col + i), f64::from(id.row + j)) * 48.0;
                    let v = c - pose.position();
                    (v.x * f.x + v.y * f.y).abs() <= 36.0 && (v.y * f.x - v.x * f.y).abs() <= 46.0
                });
            }
        }
        seen
    }

    #[test]
    fn cells_seen_agree_with_dense_sampling() {
        let mut total = 0;
        for k in (0..60).step_by(3) {
            let t = f64::from(k);
            let p = piece(
                20.0 + 7.0 * t,
                300.0 - 4.5 * t,
                0.37 * t,
                9000,
                0.02 * (t - 30.0),
            );
            let mut j = judge_with(&[]);
            let mut facts = Vec::new();
            j.watch(1, &airframe(), &p, &mut facts);
            let mut differ = 0;
            let ids: Vec<CellId> = j.sightings().map(|(id, _)| id).collect();
            for ((id, seen), truth) in j.sightings().zip(oracle(&p, &ids)) {
                assert!(truth || seen.is_none(), "{k} {id:?}");
                differ += usize::from(truth != seen.is_some());
            }
            // Looking every metre may miss a cell that is in the picture for less.
            assert!(differ <= 1, "{k}: {differ}");
            assert_eq!(facts.len(), j.n_covered());
            total += j.n_covered();
        }
        assert!(total > 20, "{total}");
    }

    #[test]
    fn a_straight_lane_sees_its_cells_in_order() {
        let mut j = judge_with(&[]);
        let mut facts = Vec::new();
        j.watch(
            7,
            &airframe(),
            &piece(0.0, 24.0, 0.0, 36_924, 0.0),
            &mut facts,
        );
        let cols: Vec<i16> = facts
            .iter()
            .map(|f| {
                if let Fact::Seen { cell, .. } = f {
                    cell.col
                } else {
                    -1
                }
            })
            .collect();
        assert_eq!(cols, (0..10).collect::<Vec<i16>>());
        let s = j.sighting(CellId { col: 3, row: 0 }).unwrap();
        // Its centre is at 168 m and comes into the picture 12 m before.
        assert_eq!(s.uav, 7);
        assert!((s.at_ms as i64 - (1000 + 156_000 / 13)).abs() < 90, "{s:?}");
        assert!((j.covered_share() - 10.0 / 80.0).abs() < 1e-12);
    }

    /// In a turn the picture of a fixed camera lies out of it: what a level one sees it does not.
    #[test]
    fn a_cell_inside_a_turn_is_not_seen_by_a_fixed_camera() {
        let fixed = Airframe {
            mount: Mount::Fixed,
            ..airframe()
        };
        let turns = |east_m: f64, radius_m: f64, ms: u64| {
            piece(east_m, 168.0 - radius_m, 0.0, ms, 13.0 / radius_m)
        };
        let before = turns(100.0, 30.0, 1_000);
        let flown = Piece {
            from_ms: 2_000,
            to_ms: 12_000,
            start: before.pose_at(2_000),
            ..before
        };
        let inside = CellId { col: 1, row: 3 };
        let saw = |eye: Eye<'_>| {
            let mut judge = judge_with(&[]);
            judge.watch(1, eye, &flown, &mut Vec::new());
            (judge.saw(1, inside, 1), judge.n_covered())
        };
        let mut camera = Camera::new(&fixed);
        camera.follow(&fixed, &before);
        camera.begin();
        camera.follow(&fixed, &flown);
        let (level, tilted) = (saw(Eye::from(&fixed)), saw(Eye::new(&fixed, &camera, 60.0)));
        assert!(level.0 && !tilted.0, "{level:?} {tilted:?}");
        // On a straight pass it sees what a level one does.
        let along = piece(20.0, 168.0, 0.0, 20_000, 0.0);
        let mut camera = Camera::new(&fixed);
        camera.follow(&fixed, &along);
        let mut judge = judge_with(&[]);
        let eye = Eye::new(&fixed, &camera, 60.0);
        judge.watch(1, eye, &along, &mut Vec::new());
        assert!(judge.n_covered() >= 5, "{}", judge.n_covered());
    }

    #[test]
    fn a_grazing_arc_enters_and_a_near_one_does_not() {
        let zone: &[(i32, i32)] = &[
            (100_000, 100_000),
            (140_000, 100_000),
            (140_000, 140_000),
            (100_000, 140_000),
        ];
        // A left turn of radius 26 m whose top is at y = start + 2 r.
        let radius = 26.0;
        let rate = 13.0 / radius;
        for (top, entries) in [(100.05, 1), (99.95, 0)] {
            let mut j = judge_with(&[zone]);
            let mut facts = Vec::new();
            let p = piece(120.0, top - 2.0 * radius, 0.0, 13_000, rate);
            j.watch(1, &airframe(), &p, &mut facts);
            let found: Vec<&Fact> = facts
                .iter()
                .filter(|f| matches!(f, Fact::ZoneEntry { .. }))
                .collect();
            assert_eq!((found.len(), j.entries()), (entries, entries), "{top}");
            if let [found] = found[..] {
                let Fact::ZoneEntry { place, zone: 0, .. } = found else {
                    panic!("{found:?}")
                };
                assert!(
                    (place.x - 120.0).abs() < 5.0 && (place.y - 100.0).abs() < 2.0,
                    "{place}"
                );
            }
        }
    }

    #[test]
    fn a_corner_clipped_between_two_steps_is_an_entry() {
        let zone: &[(i32, i32)] = &[
            (100_000, 100_000),
            (200_000, 100_000),
            (200_000, 200_000),
            (100_000, 200_000),
        ];
        let mut j = judge_with(&[zone]);
        let mut facts = Vec::new();
        // Both ends are outside; the line cuts 7 cm of the corner.
        let p = piece(93.0, 107.1, -std::f64::consts::FRAC_PI_4, 1500, 0.0);
        assert!(p.length_m() > 19.0);
        j.watch(1, &airframe(), &p, &mut facts);
        assert_eq!(j.entries(), 1);
        // Staying inside is one entry, coming back another.
        j.watch(
            1,
            &airframe(),
            &piece(150.0, 150.0, 0.0, 1000, 0.0),
            &mut facts,
        );
        j.watch(
            1,
            &airframe(),
            &piece(163.0, 150.0, 0.0, 1000, 0.0),
            &mut facts,
        );
        assert_eq!(j.entries(), 2);
    }

    #[test]
    fn separation_is_recorded_once_an_approach() {
        let mut j = judge_with(&[]);
        let mut facts = Vec::new();
        let at = |x: f64| Place {
            at: Point::new(x, 0.0),
            height_m: 50.0,
        };
        for (ms, d) in [(0, 100.0), (100, 8.0), (200, 6.0), (300, 50.0), (400, 9.0)] {
            j.separate(ms, &[(1, at(0.0)), (2, at(d))], 10.0, &mut facts);
        }
        assert_eq!(facts.len(), 2);
        let c = j.closest().unwrap();
        assert_eq!((c.at_ms, c.a, c.b), (200, 1, 2));
        assert!((c.distance_m - 6.0).abs() < 1e-12);
    }

    #[test]
    fn all_is_covered_with_the_very_last_cell_and_not_before() {
        let mut judge = judge_with(&[]);
        let survey = Arc::clone(judge.board().survey());
        let cells = survey.cells();
        let mut left = cells.iter().filter(|c| c.uncoverable.is_none()).count();
        assert!(left > 5);
        for (i, _) in cells.iter().enumerate() {
            assert_eq!(judge.complete(), left == 0, "{left} cells are left");
            let sighting = Sighting { at_ms: 9, uav: 1 };
            judge.board_mut().see(i, sighting, &mut Vec::new());
            left -= usize::from(cells[i].uncoverable.is_none());
        }
        assert!(left == 0 && judge.complete());
    }
}

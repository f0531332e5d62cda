//! What each value on the wire may hold.
//!
//! The limits of docs/protocol.md §7. A value beyond its limit is refused
//! with the whole record: nothing is clipped, since a clipped value would be one its
//! author never said.

use super::codec::{Body, WireError};
use super::message::{Beacon, Bid, CellRun, Claim, Fresh, Heartbeat, Round, State};

/// Gossip entries in a beacon: what a tenth of a second of a 64 kbit/s channel carries.
pub const GOSSIP_MAX: usize = 20;
/// Bytes of others' heartbeats in a beacon or a heartbeat, six or seven each.
pub const FRESH_MAX_BYTES: usize = 256;
/// Shortest interval that is announced between two beacons, quarters of T: one period.
pub const INTERVAL_LEAST: u8 = 4;
/// And the longest: sixteen periods. Whoever needs more air than that is out of reach.
pub const INTERVAL_MOST: u8 = 64;
/// Peers of a fleet, ground stations included: with more, gossip would not come round within
/// the window in which hops count.
pub const PEERS_MAX: usize = 256;
/// Members of a round. Each bid crosses the whole component, so that beyond about ten UAVs
/// the work is done sooner without rounds (decision 41).
pub const MEMBERS_MAX: usize = 8;
/// Runs in the plan of a claim: a section has at most six legs and the remains of a
/// commitment, takeovers add a leg each; what does not fit is not flown.
pub const PLAN_MAX: usize = 16;
/// Runs of held cells in a claim: those of one earlier plan, less what merges.
pub const HELD_MAX: usize = 16;
/// Runs a bid commits to: the flight of one waiting time crosses few fragments.
pub const COMMITS_MAX: usize = 32;
/// Run-length bytes of the covered cells in a bid (short runs are left out beyond): a bid
/// must stay short on the air, and a forgotten run only means that somebody looks twice.
pub const BID_COVERED_MAX_BYTES: usize = 256;
/// Run-length bytes of the union in a cover record.
pub const COVERED_MAX_BYTES: usize = 1000;
/// Bytes of a mission in one piece: about two beacons' time on the air. A piece of 1 KiB
/// lasts 0.14 s at 64 kbit/s, and somebody hidden sends meanwhile nearly always.
pub const CHUNK_MAX_BYTES: usize = 256;
/// Pieces of a mission: 64 KiB of rings are some 6,000 corners.
pub const CHUNKS_MAX: u16 = 256;
/// Bytes of a bit for each piece of a mission.
pub const LACKING_MAX_BYTES: usize = CHUNKS_MAX as usize / 8;
/// Farthest from the origin that the tangent plane is trusted, mm: 20 km.
pub const POSITION_MAX_MM: i32 = 20_000_000;
/// Heading, 1e-4 rad: a turn either way.
pub const HEADING_MAX_E4: i32 = 62_832;
/// Fastest speed that makes sense of a UAV, mm/s.
pub const SPEED_MAX_MMPS: u32 = 200_000;
/// Longest duration of any plan or endurance, milliseconds: a day.
pub const DURATION_MAX_MS: u32 = 86_400_000;
/// Promises of others that are accepted at once: as many as propose in one earshot. Of more
/// the author says those of the lowest numbers.
pub const ACCEPTS_MAX: usize = 32;
/// Hops beyond which nothing travels.
pub const HOPS_MAX: u8 = 16;

/// The first field of a body that is out of range.
pub(super) fn check(body: &Body) -> Result<(), WireError> {
    match body {
        Body::Beacon(b) => check_beacon(b),
        Body::State(s) => check_state(s),
        Body::Bid(s) => check_bid(s),
        Body::Claim(r) => check_claim(r),
        Body::Cover(c) => at_most("covered", c.covered.len(), COVERED_MAX_BYTES),
        Body::Mission(m) => {
            at_most("bytes", m.bytes.len(), CHUNK_MAX_BYTES)?;
            in_range("chunks", (1..=CHUNKS_MAX).contains(&m.chunks))
        }
        Body::Operator(orders) => in_range("singles", orders.is_bounded()),
        Body::Finished(_) => Ok(()),
        Body::Heartbeat(h) => check_heartbeat(h),
        Body::Intent(i) => super::intent::check(i),
        Body::Conflict(b) => super::intent::check_brief(b),
        Body::Lacking(l) => {
            in_range("holders", usize::from(l.holders) <= PEERS_MAX)?;
            at_most("pieces", l.pieces.len(), LACKING_MAX_BYTES)?;
            in_range("pieces", l.pieces.last() != Some(&0))
        }
        Body::Task(t) => super::tasks::check_task(t),
        Body::Bundle(b) => super::tasks::check_bundle(b),
        Body::Target(t) => super::target::check(t),
        Body::Detection(d) => super::detection::check(d),
        Body::Trail(t) => super::trail::check(t),
        Body::Count(c) => super::count::check(c),
        Body::Usage(u) => super::usage::check(u),
        Body::Crowd(t) => super::crowd::check(t),
        Body::Obstacles(o) => super::obstacle::check(o),
        Body::Aircraft(s) => super::aircraft::check(s),
    }
}

pub(super) fn in_range(field: &'static str, holds: bool) -> Result<(), WireError> {
    if holds {
        Ok(())
    } else {
        Err(WireError::Range { field })
    }
}

/// Whether a place along one axis lies in a mission.
pub(super) fn is_near(mm: i32) -> bool {
    mm.unsigned_abs() <= POSITION_MAX_MM.unsigned_abs()
}

/// Whether something moves along one axis as fast as anything may.
pub(super) fn is_slow(mmps: i32) -> bool {
    mmps.unsigned_abs() <= SPEED_MAX_MMPS
}

pub(super) fn at_most(field: &'static str, len: usize, cap: usize) -> Result<(), WireError> {
    in_range(field, len <= cap)
}

fn check_pose(east_mm: i32, north_mm: i32, heading_e4: i32) -> Result<(), WireError> {
    in_range("east_mm", is_near(east_mm))?;
    in_range("north_mm", is_near(north_mm))?;
    let turned = heading_e4.unsigned_abs();
    in_range("heading_e4", turned <= HEADING_MAX_E4.unsigned_abs())
}

fn check_beacon(b: &Beacon) -> Result<(), WireError> {
    check_pose(b.east_mm, b.north_mm, b.heading_e4)?;
    in_range("eccentricity", b.eccentricity <= HOPS_MAX)?;
    in_range("interval", is_interval(b.interval))?;
    in_range("sharers", usize::from(b.sharers) <= PEERS_MAX + 1)?;
    at_most("gossip", b.gossip.len(), GOSSIP_MAX)?;
    in_range("hops", b.gossip.iter().all(|g| g.hops <= HOPS_MAX))?;
    in_range("interval", b.gossip.iter().all(|g| is_interval(g.interval)))?;
    check_fresh(&b.fresh)
}

fn check_fresh(fresh: &[Fresh]) -> Result<(), WireError> {
    in_range("fresh", fresh.is_sorted_by(|a, b| a.id < b.id))?;
    in_range("hops", fresh.iter().all(|f| f.hops <= HOPS_MAX))?;
    in_range("interval", fresh.iter().all(|f| is_interval(f.interval)))
}

fn check_heartbeat(h: &Heartbeat) -> Result<(), WireError> {
    let near = |v: i32| v.unsigned_abs() <= POSITION_MAX_MM.unsigned_abs() / 100;
    in_range("interval", is_interval(h.interval))?;
    in_range("sharers", usize::from(h.sharers) <= PEERS_MAX + 1)?;
    in_range("east_dm", near(h.east_dm))?;
    in_range("north_dm", near(h.north_dm))?;
    check_fresh(&h.fresh)
}

fn is_interval(quarters: u8) -> bool {
    (INTERVAL_LEAST..=INTERVAL_MOST).contains(&quarters)
}

fn check_state(s: &State) -> Result<(), WireError> {
    check_pose(s.east_mm, s.north_mm, s.heading_e4)?;
    in_range("height_mm", is_near(s.height_mm))?;
    in_range("airspeed_mmps", s.airspeed_mmps <= SPEED_MAX_MMPS)?;
    in_range("endurance_s", s.endurance_s <= DURATION_MAX_MS / 1000)?;
    in_range("covered", s.covered <= s.cells)
}

fn check_runs(field: &'static str, runs: &[CellRun], max: usize) -> Result<(), WireError> {
    at_most(field, runs.len(), max)?;
    in_range(field, runs.iter().all(|r| r.count > 0))
}

fn check_round(r: &Round) -> Result<(), WireError> {
    at_most("members", r.members.len(), MEMBERS_MAX)?;
    in_range("members", r.members.is_sorted_by(|a, b| a.id < b.id))?;
    in_range("wait_ms", r.wait_ms <= DURATION_MAX_MS)
}

fn check_bid(s: &Bid) -> Result<(), WireError> {
    check_round(&s.round)?;
    for (field, ms) in [
        ("release_ms", s.release_ms),
        ("turn_ms", s.turn_ms),
        ("endurance_ms", s.endurance_ms),
        ("eta_ms", s.eta_ms),
    ] {
        in_range(field, ms <= DURATION_MAX_MS)?;
    }
    in_range("speed_mmps", s.speed_mmps <= SPEED_MAX_MMPS)?;
    at_most("covered", s.covered.len(), BID_COVERED_MAX_BYTES)?;
    check_runs("commits", &s.commits, COMMITS_MAX)?;
    at_most("off_loop", s.off_loop.len(), 1)?;
    s.off_loop.iter().try_for_each(|o| {
        check_pose(o.east_mm, o.north_mm, o.course_e4)?;
        in_range("ready_ms", o.ready_ms <= DURATION_MAX_MS)
    })
}

fn check_claim(r: &Claim) -> Result<(), WireError> {
    for (field, listings, max) in [("plan", &r.plan, PLAN_MAX), ("held", &r.held, HELD_MAX)] {
        at_most(field, listings.len(), max)?;
        in_range(field, listings.iter().all(|l| l.run.count > 0))?;
    }
    in_range("eta_ms", r.eta_ms <= DURATION_MAX_MS)
}

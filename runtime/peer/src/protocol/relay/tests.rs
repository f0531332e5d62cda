//! One relay at a time, with records and beacons given by hand.

use super::*;
use crate::protocol::airtime::Filling;
use crate::wire::message::MissionChunk;
use crate::wire::samples;

fn record(author: u16, seq: u32) -> Record {
    Record {
        author,
        incarnation: 1,
        seq,
        kind: 1,
        subject: 0,
        body: vec![0; 20],
        signature: Vec::new(),
    }
}

fn of_kind(kind: Kind, author: u16) -> Record {
    Record {
        kind: kind.number(),
        ..record(author, 1)
    }
}

/// The number of a neighbour's beacon.
const BEACON: u32 = 5;

/// What a beacon tells of the records that its author holds of somebody.
fn holds(id: u16, incarnation: Incarnation, max_seq: u32, digest: u16) -> Gossip {
    Gossip {
        incarnation,
        max_seq,
        digest,
        ..samples::gossip(id)
    }
}

/// A relay that has begun: it knows that it is alone.
fn relay(me: u16) -> Relay {
    let mut relay = Relay::new(me, "f", 64_000, 1000);
    for t in 0..3 {
        relay.air.plan_beacon(Time(t));
    }
    relay
}

#[test]
fn a_new_record_is_passed_on_once() {
    let mut r = relay(2);
    assert_eq!(r.offer(Time(5000), &record(1, 1), &[1; 40], 0), Offer::New);
    assert_eq!(r.poll(Time(5000)), None);
    let out = r.poll(Time(5500)).unwrap();
    assert_eq!((out.hops, out.bytes.len()), (1, 40));
    assert_eq!(r.poll(Time(6000)), None);
    assert_eq!(
        r.offer(Time(6000), &record(1, 1), &[1; 40], 0),
        Offer::Duplicate
    );
    assert_eq!(
        r.offer(Time(6000), &record(1, 0), &[1; 40], 0),
        Offer::Stale
    );
}

#[test]
fn two_copies_heard_are_enough() {
    let mut r = relay(3);
    r.offer(Time(5000), &record(1, 1), &[1; 40], 0);
    r.offer(Time(5001), &record(1, 1), &[1; 40], 1);
    assert_eq!(r.poll(Time(5500)), None);
}

/// Its author says it again because it hears nobody passing it on: whoever holds it from its author
/// waits in a full queue, and would never do so.
#[test]
fn what_its_author_repeats_is_passed_on_all_the_same() {
    let heard = |hops: &[u8]| {
        let mut r = relay(3);
        for (t, hops) in (5_000..).zip(hops) {
            r.offer(Time(t), &record(1, 1), &[1; 40], *hops);
        }
        r.poll(Time(5_500)).map(|out| out.hops)
    };
    assert_eq!(heard(&[0, 0, 0, 0]), Some(1));
    assert_eq!(heard(&[0, 0, 1]), None, "somebody passed it on");
    assert_eq!(heard(&[2, 0]), None, "two said it");
    assert_eq!(heard(&[2]), Some(3));
}

/// An order goes before all that waits, and everybody who hears it passes it on, once.
#[test]
fn an_order_is_passed_on_by_all_and_before_all_else() {
    let mut r = relay(3);
    r.offer(Time(5_000), &of_kind(Kind::Claim, 2), &[2; 40], 0);
    let order = of_kind(Kind::Operator, 100);
    for (t, hops) in (5_001..).zip([0, 1, 1, 2]) {
        r.offer(Time(t), &order, &[3; 40], hops);
    }
    let next = |r: &mut Relay, now_ms| r.poll(Time(now_ms)).map(|out| out.bytes[0]);
    assert_eq!(next(&mut r, 5_500), Some(3));
    assert_eq!(next(&mut r, 5_501), Some(2));
    assert_eq!(next(&mut r, 6_000), None, "once");
    // Said again for who lacks it, two others are enough.
    r.catch_up(Time(9_000), &holds(100, 1, 0, 0), BEACON);
    for t in [9_001, 9_002] {
        r.offer(Time(t), &order, &[3; 40], 2);
    }
    assert_eq!(next(&mut r, 9_900), None);
}

/// Where the share is taken by what is due sooner, what is followed is told late, but told.
#[test]
fn a_target_outlasts_its_turn() {
    let waits = |kind: Kind| {
        let mut r = relay(3);
        r.offer(Time(5_000), &of_kind(kind, 2), &[2; 40], 0);
        let intervals = 4 * r.air.interval_ms();
        r.poll(Time(5_000 + intervals)).is_some()
    };
    assert!(waits(Kind::Target) && waits(Kind::Claim));
    assert!(!waits(Kind::State), "for people alone");
}

#[test]
fn what_a_neighbour_lacks_is_sent_again() {
    let mut r = relay(2);
    r.offer(Time(5000), &record(1, 7), &[1; 40], 0);
    assert!(r.poll(Time(5500)).is_some());
    r.catch_up(Time(9000), &holds(1, 1, 3, 0), BEACON);
    assert!(r.poll(Time(9500)).is_some());
    let (seq, digest) = r.version(1, 1, BEACON);
    r.catch_up(Time(20_000), &holds(1, 1, seq, digest), BEACON);
    assert_eq!(r.poll(Time(20_500)), None, "nothing is lacking");
}

#[test]
fn of_whom_a_neighbour_shows_more_this_peer_says_what_it_holds() {
    let mut r = relay(2);
    for author in [1, 3] {
        r.offer(Time(5_000), &record(author, 7), &[1; 40], 0);
    }
    let (seq, digest) = r.version(1, 1, BEACON);
    let shows = |r: &mut Relay, told: Gossip| {
        r.catch_up(Time(9_000), &told, BEACON);
        r.take_behind().into_iter().collect::<Vec<u16>>()
    };
    assert_eq!(shows(&mut r, holds(1, 1, seq, digest)), [], "the same");
    assert_eq!(shows(&mut r, holds(1, 1, 6, 0)), [], "less");
    assert_eq!(shows(&mut r, holds(3, 1, 7, digest ^ 1)), [3], "others");
    assert_eq!(
        shows(&mut r, holds(1, 1, 8, 0)),
        [],
        "answered a moment ago"
    );
    r.catch_up(Time(20_000), &holds(1, 1, 8, 0), BEACON);
    r.catch_up(Time(20_000), &holds(3, 2, 1, 0), BEACON);
    r.catch_up(Time(20_000), &holds(4, 1, 1, 0), BEACON);
    r.catch_up(Time(20_000), &holds(5, 1, 0, 0), BEACON);
    r.catch_up(Time(20_000), &holds(2, 1, 9, 0), BEACON);
    let behind: Vec<u16> = r.take_behind().into_iter().collect();
    assert_eq!(behind, [1, 3, 4], "more, a later life, and one unknown");
    assert!(r.take_behind().is_empty());
}

fn piece(subject: u16, chunks: u16) -> Record {
    let piece = MissionChunk {
        revision: 2,
        content_hash: 6,
        chunks,
        bytes: vec![0; 180],
    };
    Record {
        kind: Kind::Mission.number(),
        subject,
        body: codec::encode_body(&Body::Mission(piece)),
        ..record(9, 1)
    }
}

#[test]
fn pieces_of_a_mission_outlive_the_life_that_said_them() {
    let mut r = relay(1);
    let hear = |r: &mut Relay, record: &Record| {
        r.offer(Time(5_000), record, &codec::encode_record(record), 0)
    };
    let said_later = |record: Record| Record {
        incarnation: record.incarnation + 1,
        ..record
    };
    assert_eq!(hear(&mut r, &piece(0, 3)), Offer::New);
    // The station begins another life, and says one piece anew before it is out of reach.
    assert_eq!(hear(&mut r, &said_later(piece(1, 3))), Offer::New);
    let holds = |r: &Relay, subject| r.held.keys().any(|k| k.2 == subject);
    assert!(holds(&r, 0) && holds(&r, 1));
    // The others come from somebody who heard them in the first one.
    assert_eq!(hear(&mut r, &piece(2, 3)), Offer::New);
    assert_eq!(hear(&mut r, &piece(1, 3)), Offer::Stale);
    assert!((0..3).all(|subject| holds(&r, subject)));
    // All else that the first life said is void.
    let state = Record {
        kind: Kind::State.number(),
        ..piece(9, 3)
    };
    assert_eq!(hear(&mut r, &state), Offer::Stale);
}

/// A piece of a mission of so many is heard.
fn hear_piece(r: &mut Relay, now_ms: u64, subject: u64, chunks: u16) {
    let byte = u8::try_from(subject).unwrap();
    r.offer(
        Time(now_ms),
        &piece(u16::from(byte), chunks),
        &[byte; 200],
        0,
    );
}

/// How often each of `N` pieces is sent in a time while a neighbour's beacon shows now and then
/// that it lacks them; first in each millisecond comes what is heard in it.
fn pieces_sent<const N: usize>(
    r: &mut Relay,
    during_ms: core::ops::Range<u64>,
    (every_ms, sharers): (u64, u16),
    hears: impl Fn(&mut Relay, u64),
) -> [u32; N] {
    let mut times = [0; N];
    for t in during_ms {
        hears(r, t);
        if t.is_multiple_of(every_ms) {
            let lacks = Beacon {
                revision: 1,
                sharers,
                gossip: Vec::new(),
                ..samples::beacon(1)
            };
            r.on_beacon(Time(t), 7, &lacks);
        }
        if let Some(out) = r.poll(Time(t)) {
            times[usize::from(out.bytes[0])] += 1;
        }
    }
    times
}

#[test]
fn all_pieces_of_a_mission_are_sent_in_turn_though_few_go_within_their_lifetime() {
    let mut r = relay(2);
    for subject in 0..40 {
        hear_piece(&mut r, 5_000, subject, 40);
    }
    let times: [u32; 40] = pieces_sent(&mut r, 8_000..1_200_000, (2000, 60), |_, _| ());
    let (least, most) = (times.iter().min(), times.iter().max());
    assert!(
        least >= Some(&2) && most <= Some(&(times[0] + 3)),
        "{times:?}"
    );
}

/// So many share the channel from then on, this peer included.
fn share(r: &mut Relay, now_ms: u64, sharers: u16) {
    for id in 1..sharers {
        r.air.hear(Time(now_ms), 100 + id, (64, sharers));
    }
}

#[test]
fn pieces_that_came_at_different_times_are_sent_in_turn_too() {
    let comes = |r: &mut Relay, t: u64| {
        let (subject, rest) = ((t - 5_000) / 700, t % 700);
        if subject < 98 && rest == 100 {
            hear_piece(r, t, subject, 98);
        }
    };
    let times: [u32; 98] = pieces_sent(&mut relay(2), 5_000..3_000_000, (1000, 28), comes);
    let (least, most) = (times.iter().min(), times.iter().max());
    assert!(
        least >= Some(&3) && most <= Some(&(times[0] + 3)),
        "{times:?}"
    );
}

#[test]
fn a_piece_that_nobody_passes_on_is_sent_most_often() {
    let mut r = relay(2);
    for subject in 0..40 {
        hear_piece(&mut r, 5_000, subject, 40);
    }
    // Neighbours say the others in turn, each every forty seconds.
    let passed_on = |r: &mut Relay, t: u64| {
        let subject = t / 1000 % 40;
        if t.is_multiple_of(1000) && subject != 7 {
            hear_piece(r, t, subject, 40);
        }
    };
    let times: [u32; 40] = pieces_sent(&mut r, 6_000..1_200_000, (1000, 28), passed_on);
    let others = times.iter().enumerate().filter(|(i, _)| *i != 7);
    let most = others.map(|(_, n)| *n).max().unwrap();
    assert!(times[7] > 3 * most && most > 1, "{times:?}");
}

/// A piece of one of several missions of four pieces; its byte is ten times the revision and
/// its number.
fn hear_piece_of(r: &mut Relay, now_ms: u64, (revision, subject): (u8, u8)) -> Offer {
    let chunk = MissionChunk {
        revision: u32::from(revision),
        content_hash: 6,
        chunks: 4,
        bytes: vec![0; 20],
    };
    let record = Record {
        seq: u32::from(revision) * 10 + u32::from(subject),
        body: codec::encode_body(&Body::Mission(chunk)),
        ..piece(u16::from(subject), 4)
    };
    let byte = revision.wrapping_mul(10).wrapping_add(subject);
    r.offer(Time(now_ms), &record, &[byte; 40], 0)
}

/// Which revisions' pieces are held, and of each how many.
fn held_of(r: &Relay) -> BTreeMap<u32, usize> {
    let mut held = BTreeMap::new();
    for key in r.held.keys() {
        *held.entry(key.3).or_default() += 1;
    }
    held
}

#[test]
fn what_a_longer_mission_leaves_is_not_sent_while_a_newer_one_comes() {
    let mut r = relay(2);
    r.follow(Time(4_000), 2);
    r.on_beacon(Time(4_000), 7, &beacon_of(1, 2));
    for piece in [(2, 0), (2, 1), (2, 2), (2, 3), (3, 0), (3, 1)] {
        assert_eq!(hear_piece_of(&mut r, 5_000, piece), Offer::New);
    }
    let said = (5_000..200_000).filter_map(|t| r.poll(Time(t)).map(|out| out.bytes[0]));
    let said: std::collections::BTreeSet<u8> = said.collect();
    assert_eq!(said.into_iter().collect::<Vec<u8>>(), [30, 31]);
    assert_eq!(held_of(&r), [(2, 4), (3, 2)].into());
    // Once all of the newer one is here and flown, nothing of the older one is held.
    for piece in [(3, 2), (3, 3)] {
        assert_eq!(hear_piece_of(&mut r, 200_000, piece), Offer::New);
    }
    assert_eq!(held_of(&r), [(2, 4), (3, 4)].into());
    r.follow(Time(200_000), 3);
    assert_eq!(held_of(&r), [(3, 4)].into());
    assert_eq!(hear_piece_of(&mut r, 201_000, (2, 0)), Offer::Stale);
}

#[test]
fn the_former_mission_is_said_once_the_newer_one_comes_no_more() {
    let mut r = relay(2);
    r.follow(Time(4_000), 2);
    for subject in 0..4 {
        // Others passed them on; of the newer one nobody but this peer has a piece.
        assert_eq!(hear_piece_of(&mut r, 5_000, (2, subject)), Offer::New);
        assert_eq!(hear_piece_of(&mut r, 5_001, (2, subject)), Offer::Duplicate);
    }
    for subject in 0..2 {
        assert_eq!(hear_piece_of(&mut r, 10_000, (3, subject)), Offer::New);
    }
    let mut said: Vec<(u64, u8)> = Vec::new();
    for t in 10_000..120_000 {
        // It hears nothing, and goes on lacking all.
        if t % 1_000 == 0 {
            r.on_beacon(Time(t), 7, &beacon_of(1, 2));
        }
        said.extend(r.poll(Time(t)).map(|out| (t, out.bytes[0])));
    }
    let first = |byte: u8| said.iter().find(|(_, b)| *b == byte).map(|(t, _)| *t);
    let count = |byte: u8| said.iter().filter(|(_, b)| *b == byte).count();
    assert!(first(30).is_some_and(|t| t < 22_000), "{said:?}");
    assert!(first(31).is_some_and(|t| t < 22_000), "{said:?}");
    // Twelve intervals after its last piece.
    for byte in 20..24 {
        let from = first(byte).unwrap();
        assert!((22_000..60_000).contains(&from), "{said:?}");
        assert!(count(byte) >= 3, "{said:?}");
    }
    assert!(count(30) >= 6 && count(31) >= 6, "{said:?}");
    // It goes on coming: the former one waits again.
    assert_eq!(hear_piece_of(&mut r, 120_000, (3, 2)), Offer::New);
    let later = (120_000..130_000).filter_map(|t| r.poll(Time(t)).map(|out| out.bytes[0]));
    assert!(later.into_iter().all(|byte| byte >= 30));
}

/// Of the next revision one piece in the middle is new: it goes before the others, until somebody
/// passes it on or it was on the air a few times.
#[test]
fn what_is_new_in_a_revision_goes_before_what_is_as_it_was() {
    for passed_on in [true, false] {
        let mut r = relay(2);
        r.follow(Time(4_000), 1);
        let hear = |r: &mut Relay, now_ms: u64, (revision, subject): (u32, u16), byte: u8| {
            let chunk = MissionChunk {
                revision,
                content_hash: u64::from(revision),
                chunks: 40,
                bytes: vec![byte; 180],
            };
            let record = Record {
                seq: revision * 100 + u32::from(subject),
                body: codec::encode_body(&Body::Mission(chunk)),
                ..piece(subject, 40)
            };
            let said = [u8::try_from(subject).unwrap(); 200];
            r.offer(Time(now_ms), &record, &said, 0)
        };
        for subject in 0..40 {
            assert_eq!(hear(&mut r, 5_000, (1, subject), 1), Offer::New);
        }
        for subject in 0..40 {
            let byte = if subject == 20 { 2 } else { 1 };
            assert_eq!(hear(&mut r, 6_000, (2, subject), byte), Offer::New);
        }
        let passes = |r: &mut Relay, t: u64| {
            if passed_on && t == 8_001 {
                hear(r, t, (2, 20), 2);
            }
        };
        let times: [u32; 40] = pieces_sent(&mut r, 8_000..80_000, (2000, 60), passes);
        let others = times.iter().enumerate().filter(|(i, _)| *i != 20);
        let most = others.map(|(_, n)| *n).max().unwrap();
        if passed_on {
            assert!(times[20] <= most, "{times:?}");
        } else {
            assert!((8..11).contains(&times[20]) && most < 4, "{times:?}");
        }
    }
}

/// Made-up revisions and those of long ago, in any order.
#[test]
fn of_an_author_the_mission_that_is_followed_is_held_and_few_beside_it() {
    let mut r = relay(2);
    r.follow(Time(4_000), 9);
    for subject in 0..4 {
        assert_eq!(hear_piece_of(&mut r, 5_000, (9, subject)), Offer::New);
    }
    let most = 4 + 4 * crate::library::MAX_PARTIAL;
    for step in 0..2_000_u64 {
        let [revision, subject, ..] = (step * 7919).to_le_bytes();
        hear_piece_of(&mut r, 6_000 + step, (revision.max(1), subject % 4));
        let held = held_of(&r);
        assert!(held.values().sum::<usize>() <= most, "{held:?}");
        assert_eq!(held.first_key_value(), Some((&9, &4)));
    }
    assert_eq!(hear_piece_of(&mut r, 9_000, (8, 0)), Offer::Stale);
    let held: Vec<u32> = held_of(&r).into_keys().collect();
    assert_eq!(held, [9, 252, 253, 254, 255]);
}

#[test]
fn a_mission_goes_to_who_lacks_it_and_what_is_due_before_its_next_piece_goes_first() {
    let mut r = relay(2);
    let neighbour = |revision| Beacon {
        revision,
        sharers: 60,
        gossip: Vec::new(),
        ..samples::beacon(1)
    };
    share(&mut r, 5_000, 60);
    r.on_beacon(Time(5_000), 7, &neighbour(2));
    for subject in 0..6 {
        r.offer(Time(5_000), &piece(subject, 6), &[1; 200], 0);
    }
    assert_eq!(r.version(9, 1, BEACON).0, 0, "pieces are not counted");
    assert_eq!(r.poll(Time(7_900)), None, "nobody lacks them");
    r.on_beacon(Time(8_000), 7, &neighbour(1));
    let mut sent = Vec::new();
    for t in 8_000..50_000 {
        if t == 9_000 {
            // Due within 14 s; of the pieces the third is due after 17 s.
            let said = Record {
                kind: Kind::Finished.number(),
                ..record(3, 1)
            };
            r.offer(Time(t), &said, &[3; 200], 0);
        }
        sent.extend(r.poll(Time(t)).map(|out| out.bytes[0]));
    }
    assert_eq!(sent.len(), 7, "{sent:?}");
    assert!(sent[..3].contains(&3), "{sent:?}");
    r.on_beacon(Time(50_000), 7, &neighbour(1));
    r.on_beacon(Time(50_010), 7, &neighbour(2));
    assert_eq!(r.poll(Time(60_000)), None, "nobody lacks them any more");
}

#[test]
fn own_coverage_waits_for_own_bids_and_claims_and_not_for_their_repetition() {
    let mut r = relay(2);
    share(&mut r, 5_000, 30);
    let mut sent = Vec::new();
    for t in 5_000..40_000 {
        let kind = match t {
            5_000 => Some(Kind::Claim),
            5_001 => Some(Kind::Cover),
            5_002 => Some(Kind::Bid),
            _ => None,
        };
        if let Some(kind) = kind {
            let kind = kind.number();
            r.own(
                Time(t),
                &Record {
                    kind,
                    ..record(2, 1)
                },
                vec![kind; 200],
            );
        }
        sent.extend(r.poll(Time(t)).map(|out| out.bytes[0]));
    }
    let kinds = [Kind::Claim, Kind::Bid, Kind::Cover].map(Kind::number);
    assert_eq!(sent[..3], kinds, "{sent:?}");
    assert_eq!(sent[3..].iter().filter(|k| **k == kinds[0]).count(), 2);
}

/// In a crowd that suspects somebody all the time what is said early would take each byte before
/// a long claim: once it has waited for an interval the share is saved for it, and a claim that
/// changed meanwhile has waited as long as the one before.
#[test]
fn what_is_said_early_does_not_starve_an_own_claim() {
    let mut r = relay(2);
    share(&mut r, 5_000, 30);
    for t in 0..20 {
        r.air.plan_beacon(Time(5_000 + t));
    }
    let interval_ms = r.air.interval_ms();
    // Nothing is owed, and a claim has to wait.
    let spend = |r: &mut Relay, now: Time| {
        while r.air.is_in_credit() {
            r.air.charge(now, 50);
        }
        while r.air.may_answer(now, true) {
            r.air.charge_answer(now, 60);
        }
        r.air.charge_answer(now, 20);
        now.plus_ms(r.air.wait_ms(now, 0))
    };
    let claim = |r: &mut Relay, now: Time, seq: u32| {
        let kind = Kind::Claim.number();
        let record = Record {
            kind,
            ..record(2, seq)
        };
        r.own(now, &record, vec![0; 220]);
    };
    let begun = Time(6_000);
    let mut now = spend(&mut r, begun);
    claim(&mut r, begun, 1);
    assert!(r.poll(now).is_none() && r.may_hasten(now) && r.may_answer(now));
    now = spend(&mut r, begun.plus_ms(interval_ms - 1_500));
    claim(&mut r, now, 2);
    assert!(now < begun.plus_ms(interval_ms));
    assert!(r.may_answer(now) && r.may_hasten(now));
    now = spend(&mut r, begun.plus_ms(interval_ms));
    assert!(r.poll(now).is_none() && r.air.is_in_credit());
    assert!(!r.may_hasten(now) && !r.may_answer(now), "it is saved for");
    let goes = now.plus_ms(r.air.wait_ms(now, 220));
    assert!(r.poll(goes).is_some_and(|out| out.bytes.len() == 220));
    now = spend(&mut r, goes);
    assert!(r.may_answer(now) && r.may_hasten(now));
}

#[test]
fn the_bucket_bounds_what_is_sent() {
    let mut r = relay(2);
    let (mut bytes, mut frame) = (0, Filling::default());
    for t in 0..10_000u64 {
        r.own(Time(t), &record(2, u32::try_from(t).unwrap()), vec![0; 200]);
        while let Some(out) = r.poll(Time(t)) {
            bytes += frame.add(t, out.bytes.len());
        }
    }
    assert!(bytes <= 64_000 / 8 * 10, "{bytes}");
    assert!(bytes >= 64_000 / 8 * 10 * 4 / 10, "{bytes}");
}

#[test]
fn what_waits_for_its_random_time_goes_with_what_is_sent_meanwhile() {
    let together = |sharers: u16| {
        let mut r = relay(2);
        r.air.hear(Time(5_000), 9, (4, sharers));
        for author in [1, 3, 4, 5] {
            r.offer(Time(5_000), &record(author, 1), &[1; 100], 0);
        }
        let due = r.next_timeout(Time(5_000)).unwrap();
        let sent = std::iter::from_fn(|| r.poll(due)).count();
        assert!(r.next_timeout(due).unwrap() > due);
        sent
    };
    // Three are 308 bytes; the fourth waits for its own time.
    assert_eq!(together(13), 3);
    assert_eq!(together(12), 1, "each waits for its own time");
}

#[test]
fn an_own_claim_that_nobody_passes_on_is_sent_again_twice() {
    let claim = |seq: u32| Record {
        kind: Kind::Claim.number(),
        ..record(2, seq)
    };
    let sent = |r: &mut Relay, from: u64, echo: Option<&Record>| {
        let mut sent = Vec::new();
        for t in from..from + 5_000 {
            while r.poll(Time(t)).is_some() {
                sent.push(t - from);
                echo.iter().for_each(|e| r.echo(e));
            }
        }
        sent
    };
    let mut r = relay(2);
    r.own(Time(5_000), &claim(1), vec![1; 60]);
    assert_eq!(sent(&mut r, 5_000, None), [0], "nobody is there to hear it");
    r.air.hear(Time(10_000), 1, (4, 2));
    r.own(Time(10_000), &claim(2), vec![1; 60]);
    let times = sent(&mut r, 10_000, None);
    assert_eq!((times.len(), times[0]), (3, 0), "{times:?}");
    assert!((480..720).contains(&times[1]), "{times:?}");
    r.air.hear(Time(15_000), 1, (4, 2));
    r.own(Time(15_000), &claim(3), vec![1; 60]);
    assert_eq!(
        sent(&mut r, 15_000, Some(&claim(2))).len(),
        3,
        "an older one"
    );
    r.air.hear(Time(20_000), 1, (4, 2));
    r.own(Time(20_000), &claim(4), vec![1; 60]);
    assert_eq!(sent(&mut r, 20_000, Some(&claim(4))), [0]);
    // Nor does it go along with itself where many share the channel.
    share(&mut r, 25_000, 40);
    r.own(Time(25_000), &claim(5), vec![1; 60]);
    let times = sent(&mut r, 25_000, None);
    let apart = times.windows(2).all(|w| w[1] - w[0] >= 2 * 30 * 40);
    assert!(times.len() == 2 && apart, "{times:?}");
}

#[test]
fn a_full_store_lets_telemetry_go_before_claims() {
    let of_kind = |author: u16, kind: Kind| Record {
        kind: kind.number(),
        ..record(author, 1)
    };
    let mut r = relay(2);
    let half = u16::try_from(MAX_RECORDS / 2).unwrap();
    // The claims were on the air longest ago.
    for author in 0..half {
        let claim = of_kind(1000 + author, Kind::Claim);
        r.offer(Time(1000), &claim, &[1; 40], 0);
    }
    for author in 0..2 * half {
        let state = of_kind(5000 + author, Kind::State);
        r.offer(Time(2000), &state, &[1; 40], 0);
    }
    let held = r.records();
    let claims = held.iter().filter(|h| h.kind == Kind::Claim.number());
    assert_eq!(held.len(), MAX_RECORDS);
    assert_eq!(claims.count(), usize::from(half));
}

#[test]
fn a_digest_tells_which_records_are_held_and_not_only_the_newest() {
    let mut whole = relay(2);
    let mut hole = relay(3);
    for seq in 1..=6 {
        let record = Record {
            subject: u16::try_from(seq).unwrap(),
            ..record(1, seq)
        };
        whole.offer(Time(5000), &record, &[1; 40], 0);
        if seq != 3 {
            hole.offer(Time(5000), &record, &[1; 40], 0);
        }
    }
    let ((seq, digest), (other_seq, other)) =
        (whole.version(1, 1, BEACON), hole.version(1, 1, BEACON));
    assert_eq!((seq, other_seq), (6, 6));
    assert_ne!(digest, other);
}

/// What this relay sends until then, by subject, as a modem would take it.
fn sends(r: &mut Relay, from_ms: u64, until_ms: u64) -> BTreeSet<u16> {
    let mut subjects = BTreeSet::new();
    for t in (from_ms..until_ms).step_by(20) {
        while let Some(out) = r.poll(Time(t)) {
            let held = r.held.values().find(|h| h.bytes == out.bytes);
            subjects.insert(held.unwrap().record.subject);
        }
    }
    subjects
}

/// Records of one kind of which digests do not tell which differ, with subjects as their numbers.
fn many(author: u16, seq: u32) -> (Record, Vec<u8>) {
    let record = Record {
        kind: Kind::Task.number(),
        subject: u16::try_from(seq).unwrap(),
        ..record(author, seq)
    };
    (record, vec![u8::try_from(seq).unwrap(); 20])
}

#[test]
fn of_many_records_the_newest_are_said_again_and_others_in_turn() {
    let mut r = relay(2);
    for seq in 1..=20 {
        let (record, bytes) = many(1, seq);
        r.offer(Time(5_000), &record, &bytes, 0);
        r.offer(Time(5_000), &record, &bytes, 1);
    }
    let newest: BTreeSet<u16> = (17..=20).collect();
    let mut all = BTreeSet::new();
    for beacon in 0..30 {
        let now_ms = 20_000 + 20_000 * u64::from(beacon);
        let (seq, digest) = r.version(1, 1, beacon);
        r.catch_up(Time(now_ms), &holds(1, 1, seq, digest ^ 0x8000), beacon);
        let said = sends(&mut r, now_ms, now_ms + 19_000);
        assert_eq!(said.len(), 2 * NEWEST, "{said:?}");
        assert!(said.is_superset(&newest), "{said:?}");
        all.extend(said);
    }
    assert_eq!(all, (1..=20).collect());
    // Who shows a lower number lacks all that came since.
    r.catch_up(Time(700_000), &holds(1, 1, 3, 0), BEACON);
    assert_eq!(sends(&mut r, 700_000, 720_000), (4..=20).collect());
}

/// Of two own records one is passed on; the other nobody has, and both are older than what a
/// neighbour shows.
#[test]
fn what_nobody_passed_on_is_said_again_whatever_came_later() {
    let mut r = relay(2);
    for seq in 1..=4 {
        let (record, bytes) = many(2, seq);
        r.own(Time(5_000), &record, bytes);
    }
    assert_eq!(sends(&mut r, 5_000, 9_000).len(), 4);
    for seq in [1, 3] {
        r.echo(&many(2, seq).0);
    }
    r.catch_up(Time(20_000), &holds(2, 1, 3, 0), BEACON);
    assert_eq!(sends(&mut r, 20_000, 39_000), BTreeSet::from([2, 4]));
    r.catch_up(Time(40_000), &holds(2, 1, 3, 0), BEACON);
    assert_eq!(sends(&mut r, 40_000, 59_000), BTreeSet::from([4]), "once");
}

#[test]
fn of_equal_numbers_only_what_differs_is_said_again() {
    let of = |kind: Kind, seq| Record {
        kind: kind.number(),
        ..record(1, seq)
    };
    let kinds = [Kind::State, Kind::Bid, Kind::Claim, Kind::Finished];
    let holding = |numbers: [u32; 4]| {
        let mut r = relay(2);
        for (kind, seq) in kinds.into_iter().zip(numbers).filter(|(_, seq)| *seq > 0) {
            r.offer(Time(5_000), &of(kind, seq), &[kind.number(); 40], 0);
        }
        while r.next_timeout(Time(9_000)).is_some() {
            assert!(r.poll(Time(9_000)).is_some());
        }
        r
    };
    let said = |theirs: [u32; 4]| {
        let (mut mine, theirs) = (holding([38, 35, 39, 40]), holding(theirs));
        let (max_seq, digest) = theirs.version(1, 1, BEACON);
        mine.catch_up(Time(20_000), &holds(1, 1, max_seq, digest), BEACON);
        let out = (20_000..22_000).filter_map(|t| mine.poll(Time(t)).map(|out| out.bytes[0]));
        let mut out: Vec<u8> = out.collect();
        out.sort_unstable();
        out
    };
    let [state, bid, claim, finished] = kinds.map(Kind::number);
    assert_eq!(said([38, 35, 39, 40]), []);
    // `finished` has no bits of its own: it goes whatever differs.
    assert_eq!(said([29, 35, 39, 40]), [state, finished]);
    assert_eq!(said([0, 35, 33, 40]), [state, claim, finished]);
    assert_eq!(said([38, 0, 39, 40]), [bid, finished]);
    // Sixteen, eight and four numbers apart the bits are equal: the hash tells, not of which.
    assert_eq!(said([22, 31, 31, 40]), [state, bid, claim, finished]);
    // A lower number is lacking what came later, whatever the digests say.
    assert_eq!(said([38, 35, 0, 0]), [claim, finished]);
}

#[test]
fn what_one_beacon_does_not_tell_apart_the_next_one_does() {
    let bid = |seq| Record {
        kind: Kind::Bid.number(),
        ..record(1, seq)
    };
    // The last two bits of a bid's number are told, so these are alike but for the hash.
    let holding = |seq| {
        let mut r = relay(2);
        r.offer(Time(5_000), &bid(seq), &[1; 40], 0);
        r.offer(Time(5_000), &record(1, 1_000), &[1; 40], 0);
        r
    };
    let mine = holding(1);
    let digest = |r: &Relay, beacon| r.version(1, 1, beacon).1;
    let mut alike = 0;
    for theirs in (5..805).step_by(4).map(holding) {
        let told = |beacon| digest(&mine, beacon) != digest(&theirs, beacon);
        alike += (0..8).filter(|beacon| !told(*beacon)).count();
        assert!((0..8).any(told));
    }
    // Of 1,600 pairs one in 128.
    assert!((2..40).contains(&alike), "{alike}");
}

#[test]
fn only_what_a_neighbour_lacks_is_sent_again_and_nothing_twice_in_two_periods() {
    let of = |subject: u16, seq: u32| Record {
        subject,
        ..record(1, seq)
    };
    let mut r = relay(2);
    for seq in 1..=4 {
        let subject = u16::try_from(seq).unwrap();
        r.offer(Time(5000), &of(subject, seq), &[1; 40], 0);
    }
    let drain = |r: &mut Relay, from: u64| {
        let mut n = 0;
        for t in from..from + 1_000 {
            n += usize::from(r.poll(Time(t)).is_some());
        }
        n
    };
    assert_eq!(drain(&mut r, 5_000), 4);
    // A neighbour has what came up to the second one.
    r.catch_up(Time(9_000), &holds(1, 1, 2, 0), BEACON);
    assert_eq!(drain(&mut r, 9_000), 2);
    // They were on the air a moment ago: another neighbour has to wait.
    r.catch_up(Time(11_000), &holds(1, 1, 2, 0), BEACON);
    assert_eq!(drain(&mut r, 11_000), 0);
    // Who has the newest but not all of it gets all.
    r.catch_up(Time(20_000), &holds(1, 1, 4, 0xdead), BEACON);
    assert_eq!(drain(&mut r, 20_000), 4);
}

#[test]
fn a_relay_with_nothing_to_send_asks_for_no_time_and_tells_what_it_holds() {
    let mut r = relay(2);
    assert_eq!(r.next_timeout(Time(1_000)), None);
    r.offer(Time(5_000), &record(1, 1), &[1; 40], 0);
    let due = r.next_timeout(Time(5_000)).unwrap();
    assert!(due > Time(5_000), "{due:?}");
    assert_eq!(r.poll(Time(due.0 - 1)), None);
    assert!(r.poll(due).is_some());
    assert_eq!(r.next_timeout(due), None);
    assert_eq!(
        r.loads(),
        [
            ("records", 1, MAX_RECORDS),
            ("queue", 0, MAX_QUEUE),
            ("neighbours", 0, PEERS_MAX)
        ]
    );
}

#[test]
fn who_knows_an_earlier_life_lacks_all_of_the_later_one_and_who_knows_a_later_one_nothing() {
    let mut r = relay(2);
    let of_life_2 = Record {
        incarnation: 2,
        ..record(1, 7)
    };
    r.offer(Time(5_000), &of_life_2, &[1; 40], 0);
    assert!(r.poll(Time(5_500)).is_some());
    let (seq, digest) = r.version(1, 2, BEACON);
    for (told_life, told_seq, lacks) in [
        // In an earlier life the same numbers mean other records, and it may have
        // written more.
        (1, seq, true),
        (1, seq + 2, true),
        (2, seq, false),
        (2, seq + 2, false),
        (3, seq - 2, false),
    ] {
        let mut r = r.clone();
        r.catch_up(Time(9_000), &holds(1, told_life, told_seq, digest), BEACON);
        let again = (9_000..10_000).filter(|t| r.poll(Time(*t)).is_some());
        assert_eq!(again.count() == 1, lacks, "life {told_life}, {told_seq}");
    }
}

#[test]
fn what_is_due_goes_before_what_only_shares_its_headers() {
    let mut r = relay(2);
    r.air.hear(Time(5_000), 9, (4, 13));
    let of = |author, kind: Kind| Record {
        kind: kind.number(),
        ..record(author, 1)
    };
    // Its random time is over after 20 ms and 30 for each of 13 at most.
    r.offer(Time(5_000), &of(1, Kind::State), &[1; 40], 0);
    // A claim is to be sent sooner than a state, once its random time is over.
    r.offer(Time(5_400), &of(3, Kind::Claim), &[1; 40], 0);
    r.own(Time(5_411), &of(2, Kind::Finished), vec![1; 40]);
    let sent = std::iter::from_fn(|| r.poll(Time(5_411)));
    let authors: Vec<String> = sent.map(|out| out.key).collect();
    assert_eq!(
        authors,
        ["f/v4/finished/0/2", "f/v4/state/0/1", "f/v4/claim/0/3"]
    );
}

/// What a neighbour says it lacks of the mission of which [`piece`] gives the pieces.
fn lacking(pieces: &[u16], holders: u16) -> Lacking {
    Lacking {
        revision: 2,
        content_hash: 6,
        holders,
        pieces: Lacking::bits(256, |piece| pieces.contains(&piece)),
    }
}

fn beacon_of(revision: u32, sharers: u16) -> Beacon {
    Beacon {
        revision,
        sharers,
        gossip: Vec::new(),
        ..samples::beacon(1)
    }
}

#[test]
fn just_the_pieces_that_neighbours_say_they_lack_are_said_and_the_most_wanted_first() {
    let mut r = relay(2);
    for subject in 0..40 {
        hear_piece(&mut r, 5_000, subject, 40);
    }
    let says = |r: &mut Relay, t: u64, id: u16, pieces: &[u16]| {
        r.on_beacon(Time(t), id, &beacon_of(1, 9));
        r.on_lacking(Time(t), id, &lacking(pieces, 0));
    };
    let mut said = Vec::new();
    for t in 9_000..30_000 {
        match t {
            9_000 => says(&mut r, t, 7, &[3, 5, 30]),
            9_001 => says(&mut r, t, 8, &[5, 30]),
            9_002 => says(&mut r, t, 9, &[30]),
            // Another neighbour said one of them meanwhile: it is not said twice.
            9_003 => hear_piece(&mut r, t, 3, 40),
            15_000 => says(&mut r, t, 7, &[5]),
            15_001 => says(&mut r, t, 8, &[]),
            15_002 => r.on_beacon(Time(t), 9, &beacon_of(2, 9)),
            _ => {}
        }
        // The random times of all are over.
        let polled = (t > 9_400).then(|| r.poll(Time(t))).flatten();
        said.extend(polled.map(|out| out.bytes[0]));
    }
    assert_eq!(said, [30, 5, 5]);
    // What is said of another mission hides nothing of this one.
    let other = Lacking {
        revision: u32::MAX,
        ..lacking(&[], 1)
    };
    r.on_beacon(Time(30_000), 8, &beacon_of(1, 9));
    r.on_lacking(Time(30_000), 8, &other);
    let rest = (30_000..90_000).filter_map(|t| r.poll(Time(t)).map(|out| out.bytes[0]));
    let rest: std::collections::BTreeSet<u8> = rest.collect();
    assert_eq!(rest.len(), 40);
}

/// A big mission that one station of a crowd has: alone it would take eight minutes to say it.
#[test]
fn those_who_lack_a_mission_lend_to_who_has_it_and_nobody_sends_more_than_its_part() {
    let all: Vec<u16> = (0..76).collect();
    let took_s = |holders: u16| {
        let mut r = relay(9);
        share(&mut r, 5_000, 29);
        r.follow(Time(5_000), 2);
        for subject in 0..76 {
            let own = piece(subject, 76);
            let byte = u8::try_from(subject).unwrap();
            r.on_beacon(Time(5_000), 100, &beacon_of(1, 29));
            r.own(Time(5_000), &own, vec![byte; 280]);
        }
        let mut said = std::collections::BTreeSet::new();
        let (mut bytes, mut frame) = (0, Filling::default());
        for t in 5_000..600_000 {
            if t % 1_000 < 28 {
                let id = 100 + u16::try_from(t % 1_000).unwrap();
                r.on_beacon(Time(t), id, &beacon_of(1, 29));
                let left = all.iter().copied().filter(|p| !said.contains(p));
                r.on_lacking(Time(t), id, &lacking(&left.collect::<Vec<_>>(), holders));
            }
            while let Some(out) = r.poll(Time(t)) {
                bytes += frame.add(t, out.bytes.len());
                said.insert(u16::from(out.bytes[0]));
            }
            if said.len() == 76 {
                return ((t - 5_000) / 1_000, bytes as u64);
            }
        }
        panic!("{} of 76 were said", said.len())
    };
    let ((alone_s, _), (lent_s, bytes)) = (took_s(0), took_s(1));
    assert!(alone_s > 160 && lent_s < 60, "{alone_s} {lent_s}");
    // A share of 124 bytes a second and a tenth of 28 others, and what a bucket holds.
    assert!(bytes < lent_s * (124 + 348) + 3 * 124 + 2 * 348, "{bytes}");
    // Of several who have it each borrows its part.
    let among_four_s = took_s(4).0;
    assert!(
        among_four_s > lent_s && among_four_s < alone_s,
        "{among_four_s}"
    );
}

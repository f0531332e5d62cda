//! What a mission looks for besides what it is to see, and what follows when that is seen
//! (D2.7 §1.2.3, §3.7).

use super::vehicles::{colour, looks};
use skein_interop::json::{Error, Node};
use skein_peer::criteria::{AT_MOST, AT_MOST_MAX, CRITERIA_MAX, Criterion, Then, WORTH};
use skein_peer::mission::mm;
use skein_peer::wire::tasks::WORTH_MAX;

/// Reads `mission.detections`.
pub(crate) fn of_mission(mission: &Node<'_>) -> Result<Vec<Criterion>, Error> {
    let Some(list) = mission.get("detections")? else {
        return Ok(Vec::new());
    };
    let items = list.items()?;
    if items.len() > CRITERIA_MAX {
        return Err(list.wrong(format!(
            "has {} criteria; expected {CRITERIA_MAX} at most",
            items.len()
        )));
    }
    items.iter().map(criterion).collect()
}

fn criterion(node: &Node<'_>) -> Result<Criterion, Error> {
    let f = node.fields(&[
        "kind",
        "colour",
        "moving",
        "faster_than_m_s",
        "then",
        "for_s",
        "stand_off_m",
        "worth",
        "at_most",
    ])?;
    let then = f.need("then", "\"notify\"")?;
    let then = then.one_of(&Then::ALL.map(|t| (t.name(), t)))?;
    let length_mm = |name: &str, most: f64, unit: &str| {
        let value = f.number_or(name, 0.0, 0.0, most, unit)?;
        Ok::<u32, Error>(mm(value).unsigned_abs())
    };
    let criterion = Criterion {
        looks: f.get("kind").map(looks).transpose()?,
        colour: f.get("colour").map(colour).transpose()?,
        moving: f.get("moving").map(Node::flag).transpose()?,
        faster_mmps: length_mm("faster_than_m_s", 60.0, "m/s")?,
        then,
        for_ms: f
            .get("for_s")
            .map_or(Ok(0), |n| Ok(1000 * n.whole(1, 86_400, "seconds")?))?,
        stand_off_mm: length_mm("stand_off_m", 1_000.0, "metres")?,
        worth: f.small_or("worth", WORTH, 1, WORTH_MAX, "the worth of a task")?,
        at_most: f.small_or("at_most", AT_MOST, 1, AT_MOST_MAX, "objects")?,
    };
    match criterion.check() {
        Ok(()) => Ok(criterion),
        Err((field, text)) => Err(f.get(field).unwrap_or(node).wrong(text)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::read::testing::mission_of;

    fn with(mission: &str) -> Result<Vec<Criterion>, String> {
        mission_of(mission).map(|m| m.detections.clone())
    }

    #[test]
    fn criteria_are_read_or_refused_with_place_and_remedy() {
        let read = with(
            "{ detections: [{ kind: 'car', moving: true, faster_than_m_s: 4.5, then: 'follow', for_s: 300, stand_off_m: 30 }, { kind: 3, colour: 'red', moving: false, then: 'notify', at_most: 2 }] }",
        );
        let read = read.unwrap();
        assert_eq!((read[0].looks, read[0].faster_mmps), (Some(1), 4_500));
        assert_eq!((read[0].then, read[0].for_ms), (Then::Follow, 300_000));
        assert_eq!((read[1].looks, read[1].at_most), (Some(3), 2));
        assert_eq!((read[0].colour, read[1].colour), (None, Some(4)));
        for (text, why) in [
            ("{ detections: [{ kind: 'car' }] }", "then"),
            (
                "{ detections: [{ then: 'follow' }] }",
                "expected 1 to 86400 seconds",
            ),
            ("{ detections: [{ then: 'shoot' }] }", "detections[0].then"),
            (
                "{ detections: [{ kind: 'cart', then: 'notify' }] }",
                "no vehicle is a",
            ),
            (
                "{ detections: [{ then: 'notify', for_s: 9 }] }",
                "is not followed",
            ),
            (
                "{ detections: [{ then: 'notify', colour: 'yelow' }] }",
                "no vehicle is \"yelow\"; did you mean yellow?",
            ),
            (
                "{ detections: [{ then: 'notify', size: 'large' }] }",
                "size",
            ),
        ] {
            let said = with(text).unwrap_err();
            assert!(said.contains(why), "{said}");
        }
    }
}

//! Which peers of a run speak under the id of another. Checks and the account know each peer by
//! its number, which is that of its radio.

use std::collections::{BTreeMap, BTreeSet};

/// The id of each twin, by its number, and which of them have no airframe of their own.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Twins {
    ids: BTreeMap<u16, u16>,
    aboard: BTreeSet<u16>,
}

impl Twins {
    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.ids.is_empty()
    }

    /// The number and the id of each.
    pub fn iter(&self) -> impl Iterator<Item = (u16, u16)> {
        self.ids.iter().map(|(number, id)| (*number, *id))
    }

    /// The id under which the peer with this number speaks.
    #[must_use]
    pub fn id_of(&self, number: u16) -> u16 {
        self.ids.get(&number).copied().unwrap_or(number)
    }

    /// The same, these being programs in the airframe of the UAV whose number is their id.
    #[must_use]
    pub fn with_aboard(mut self, numbers: impl IntoIterator<Item = u16>) -> Self {
        self.aboard.extend(numbers);
        self
    }

    /// In whose airframe a peer is.
    #[must_use]
    pub fn airframe_of(&self, number: u16) -> u16 {
        if self.aboard.contains(&number) {
            self.id_of(number)
        } else {
            number
        }
    }

    /// The ids that more than one have, ascending.
    #[must_use]
    pub fn shared(&self) -> BTreeSet<u16> {
        self.ids.values().copied().collect()
    }

    /// Whether more than one have this id.
    #[must_use]
    pub fn is_shared(&self, id: u16) -> bool {
        self.ids.values().any(|of| *of == id)
    }

    /// The numbers of all others with the id of this one.
    #[must_use]
    pub fn others(&self, number: u16) -> Vec<u16> {
        let id = self.id_of(number);
        let twins = self.iter().filter(|(_, of)| *of == id);
        let all = twins.map(|(n, _)| n).chain([id]);
        all.filter(|n| *n != number).collect()
    }
}

impl FromIterator<(u16, u16)> for Twins {
    fn from_iter<T: IntoIterator<Item = (u16, u16)>>(each: T) -> Self {
        Self {
            ids: each.into_iter().collect(),
            aboard: BTreeSet::new(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_is_known_by_its_number_and_speaks_under_its_id() {
        let twins = Twins::from_iter([(9, 3), (8, 3)]);
        assert_eq!([3, 8, 9, 4].map(|n| twins.id_of(n)), [3, 3, 3, 4]);
        assert_eq!(twins.others(3), [8, 9]);
        assert_eq!(twins.others(9), [8, 3]);
        assert!(twins.others(4).is_empty());
        assert!(twins.is_shared(3) && !twins.is_shared(9));
        assert_eq!(twins.shared(), BTreeSet::from([3]));
        let twins = twins.with_aboard([8]);
        assert_eq!([3, 8, 9, 4].map(|n| twins.airframe_of(n)), [3, 3, 9, 4]);
    }
}

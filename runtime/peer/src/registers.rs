//! Registers whose numbers grow, of many authors and lives: of each the one that says more is kept,
//! so they merge in any order.

use crate::Incarnation;
use std::collections::BTreeMap;

/// What stands in a register.
pub(crate) trait Grows: Clone {
    /// What it is of, as a hash: of other sites or streets its numbers begin at nothing.
    fn of(&self) -> u32;

    /// How much it says.
    fn amount(&self) -> u64;
}

/// All that are known, by subject, author and life; `MOST` at most.
#[derive(Debug)]
pub(crate) struct Registers<R, const MOST: usize> {
    all: BTreeMap<(u16, u16, Incarnation), R>,
}

impl<R, const MOST: usize> Default for Registers<R, MOST> {
    fn default() -> Self {
        Self {
            all: BTreeMap::new(),
        }
    }
}

impl<R: Grows, const MOST: usize> Registers<R, MOST> {
    /// An own one, as it is told.
    pub fn told(&mut self, key: (u16, u16, Incarnation), register: R) {
        self.all.insert(key, register);
    }

    /// One of another. Where there is no room those go that are of anything but `of`.
    pub fn hear(&mut self, key: (u16, u16, Incarnation), register: &R, of: u32) {
        if self.all.len() >= MOST && !self.all.contains_key(&key) {
            self.all.retain(|_, held| held.of() == of);
            if self.all.len() >= MOST {
                return;
            }
        }
        let held = self.all.entry(key).or_insert_with(|| register.clone());
        // Its numbers grow, unless it is of something else.
        if held.of() != register.of() || register.amount() >= held.amount() {
            held.clone_from(register);
        }
    }

    /// Those of one thing, with subject and author.
    pub fn of(&self, of: u32) -> impl Iterator<Item = (u16, u16, &R)> {
        let those = self.all.iter().filter(move |(_, held)| held.of() == of);
        those.map(|((subject, author, _), held)| (*subject, *author, held))
    }

    /// How many are kept.
    pub fn len(&self) -> usize {
        self.all.len()
    }
}

//! The operator's standing orders (D2.7 §1.2.2): one type for consoles, radio and files.

use core::fmt;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Most UAVs that may be told something of their own at a time.
pub const SINGLES_MAX: usize = 32;

/// What the operator wants of a UAV, until the next order.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Order {
    /// Carry on with the mission.
    #[default]
    Resume,
    /// Loiter where you are.
    Hold,
    /// Return to base and loiter there.
    ReturnToBase,
}

impl Order {
    /// All of them, in the order of their numbers.
    pub const ALL: [Self; 3] = [Self::Resume, Self::Hold, Self::ReturnToBase];

    /// Its name, as a person writes it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Resume => "resume",
            Self::Hold => "hold",
            Self::ReturnToBase => "return-to-base",
        }
    }
}

/// All that stands of what an operator ordered: one value, so that of two the later one is
/// what the operator wants, whatever was lost between them.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Orders {
    /// To all whom it tells nothing of their own.
    pub all: Order,
    /// To single UAVs, by their numbers; each is another one than that to all.
    #[serde(default)]
    pub singles: BTreeMap<u16, Order>,
}

impl Orders {
    /// What a UAV is to do.
    #[must_use]
    pub fn of(&self, uav: u16) -> Order {
        self.singles.get(&uav).copied().unwrap_or(self.all)
    }

    /// The same once one UAV is told something, or all are: that ends what single ones were
    /// told. None where more than [`SINGLES_MAX`] would be told something of their own.
    #[must_use]
    pub fn told(&self, uav: Option<u16>, order: Order) -> Option<Self> {
        let Some(uav) = uav else {
            return Some(order.into());
        };
        let mut next = self.clone();
        if order == self.all {
            next.singles.remove(&uav);
        } else {
            next.singles.insert(uav, order);
        }
        next.is_bounded().then_some(next)
    }

    /// Whether it is as told here: no more single UAVs than may be, each told something else
    /// than all.
    #[must_use]
    pub fn is_bounded(&self) -> bool {
        self.singles.len() <= SINGLES_MAX && self.singles.values().all(|o| *o != self.all)
    }
}

impl From<Order> for Orders {
    fn from(all: Order) -> Self {
        Self {
            all,
            singles: BTreeMap::new(),
        }
    }
}

impl fmt::Display for Orders {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.all.name())?;
        for (uav, order) in &self.singles {
            write!(f, ", uav{uav} {}", order.name())?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_order_to_one_stands_until_it_or_all_are_told_something_else() {
        let told = |o: &Orders, uav, order| o.told(uav, order).unwrap();
        let orders = told(&Orders::default(), Some(3), Order::ReturnToBase);
        assert_eq!(
            (orders.of(3), orders.of(4)),
            (Order::ReturnToBase, Order::Resume)
        );
        assert_eq!(orders.to_string(), "resume, uav3 return-to-base");
        let both = told(&orders, Some(4), Order::Hold);
        assert_eq!((both.of(3), both.of(4)), (Order::ReturnToBase, Order::Hold));
        let again = told(&both, Some(3), Order::Resume);
        assert_eq!(again.singles.keys().copied().collect::<Vec<_>>(), [4]);
        assert_eq!(told(&again, None, Order::Hold), Order::Hold.into());
        assert_eq!(
            told(&Order::Hold.into(), Some(1), Order::Hold),
            Order::Hold.into()
        );
    }

    #[test]
    fn no_more_single_ones_than_a_record_holds() {
        let mut orders = Orders::default();
        for uav in (0_u16..).take(SINGLES_MAX) {
            orders = orders.told(Some(uav), Order::Hold).unwrap();
        }
        assert_eq!(orders.told(Some(999), Order::Hold), None);
        assert!(orders.told(Some(0), Order::ReturnToBase).is_some());
        assert!(orders.told(None, Order::Hold).is_some());
    }
}

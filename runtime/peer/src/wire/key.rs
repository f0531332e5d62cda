//! Natural keys: `<fleet>/v4/<kind>/<subject>/<author>`.
//!
//! The addressing of docs/protocol.md §7: an observer attached to any peer sees the
//! whole fleet under names that say what they carry. Only the author *originates*
//! under its keys; relays put the same bytes there again.

use super::kinds::Kind;

/// The version of everything on the wire. Another layout of any body is another
/// version: peers of two versions do not hear each other.
pub const VERSION: &str = "v4";

/// Longest fleet name, bytes: a key stays below 64 bytes.
pub const FLEET_MAX_BYTES: usize = 32;

/// Why a key or a fleet name was refused.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum KeyError {
    /// The fleet name is empty, too long or holds other than `a-z`, `0-9`, `-`, `_`.
    #[error("fleet name {name:?} must be 1 to 32 of a-z, 0-9, '-' and '_'")]
    Fleet {
        /// The name.
        name: String,
    },
    /// The key is not one of ours.
    #[error("key is not <fleet>/v4/<kind>/<subject>/<author>; what came under it is ignored")]
    Shape,
}

/// The parts of a key.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Key {
    /// The fleet.
    pub fleet: String,
    /// The kind.
    pub kind: Kind,
    /// Which of the author's registers of that kind.
    pub subject: u16,
    /// Who originates under it.
    pub author: u16,
}

/// Checks a fleet name: it must be a chunk of a key without wildcards.
///
/// # Errors
/// [`KeyError::Fleet`].
pub fn check_fleet(name: &str) -> Result<(), KeyError> {
    let allowed = |b: u8| b.is_ascii_lowercase() || b.is_ascii_digit() || b == b'-' || b == b'_';
    if name.is_empty() || name.len() > FLEET_MAX_BYTES || !name.bytes().all(allowed) {
        return Err(KeyError::Fleet {
            name: name.chars().take(FLEET_MAX_BYTES + 1).collect(),
        });
    }
    Ok(())
}

/// The key of a register.
#[must_use]
pub fn key(fleet: &str, kind: Kind, subject: u16, author: u16) -> String {
    format!("{fleet}/{VERSION}/{}/{subject}/{author}", kind.name())
}

/// Reads a key.
///
/// # Errors
/// [`KeyError`] where it is not exactly what [`key`] writes.
pub fn parse(text: &str) -> Result<Key, KeyError> {
    let mut parts = text.split('/');
    let mut next = || parts.next().ok_or(KeyError::Shape);
    let fleet = next()?;
    let version = next()?;
    let kind = Kind::of_name(next()?).ok_or(KeyError::Shape)?;
    let subject = number(next()?)?;
    let author = number(next()?)?;
    if version != VERSION || parts.next().is_some() {
        return Err(KeyError::Shape);
    }
    check_fleet(fleet)?;
    Ok(Key {
        fleet: fleet.to_owned(),
        kind,
        subject,
        author,
    })
}

/// A number written the one way `key` writes it: no sign, no leading zero.
fn number(text: &str) -> Result<u16, KeyError> {
    let plain =
        text.bytes().all(|b| b.is_ascii_digit()) && (text.len() == 1 || !text.starts_with('0'));
    text.parse().ok().filter(|_| plain).ok_or(KeyError::Shape)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn keys_come_back(fleet in "[a-z0-9_-]{1,32}", kind in 0_u8..12, subject: u16, author: u16) {
            let kind = Kind::of_number(kind).unwrap();
            let text = key(&fleet, kind, subject, author);
            prop_assert_eq!(parse(&text), Ok(Key { fleet, kind, subject, author }));
        }

        #[test]
        fn whatever_parses_is_what_would_be_written(text in "[a-z/]{0,3}/v4/(state|cover)/[+0-9]{1,6}/[0-9]{1,3}") {
            if let Ok(k) = parse(&text) {
                prop_assert_eq!(key(&k.fleet, k.kind, k.subject, k.author), text);
            }
        }
    }

    #[test]
    fn names_and_keys_of_others_are_refused() {
        for name in ["", "a/b", "Fleet", "a*", "$x", "é", &"a".repeat(33)] {
            assert!(check_fleet(name).is_err(), "{name:?}");
        }
        for text in [
            "",
            "a/v4/state/0",
            "a/v4/state/0/1/2",
            "a/v1/state/0/1",
            "a/v4/rumour/0/1",
            "a/v4/state/00/1",
            "a/v4/state/0/65536",
        ] {
            assert_eq!(parse(text), Err(KeyError::Shape), "{text}");
        }
    }
}

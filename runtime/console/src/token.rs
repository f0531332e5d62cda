//! A secret that only this user can read.

use crate::private_file::replace_private_file;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

/// Bytes drawn for a token: nobody guesses 256 bits.
const DRAWN_BYTES: usize = 32;

/// The longest token that is looked at, characters.
pub(crate) const MAX_TOKEN_CHARS: usize = 128;

/// Why there is no token.
#[derive(Debug, thiserror::Error)]
pub enum TokenError {
    /// The system gives no random bytes.
    #[error("no random bytes for a token: {0}")]
    Entropy(getrandom::Error),
    /// The file cannot be written or read.
    #[error("token file {path}: {cause}")]
    File {
        /// Which.
        path: PathBuf,
        /// Why.
        cause: std::io::Error,
    },
}

/// Proves that a request comes from the user who started the program.
#[derive(Clone, PartialEq, Eq)]
pub struct Token(String);

impl Token {
    /// A new one, drawn from the system's entropy.
    ///
    /// # Errors
    /// When the system gives none.
    pub fn draw() -> Result<Self, TokenError> {
        let mut bytes = [0; DRAWN_BYTES];
        getrandom::fill(&mut bytes).map_err(TokenError::Entropy)?;
        Ok(Self(bytes.iter().map(|b| format!("{b:02x}")).collect()))
    }

    /// A token as it was told; none when it is empty, too long, or holds anything but
    /// letters and digits.
    #[must_use]
    pub fn told(text: &str) -> Option<Self> {
        let fits = (1..=MAX_TOKEN_CHARS).contains(&text.len());
        let plain = text.bytes().all(|b| b.is_ascii_alphanumeric());
        (fits && plain).then(|| Self(text.to_owned()))
    }

    /// The secret itself.
    #[must_use]
    pub fn secret(&self) -> &str {
        &self.0
    }

    /// Whether `said` is this token. Takes as long for a near miss as for any other.
    #[must_use]
    pub fn is(&self, said: &str) -> bool {
        let (a, b) = (self.0.as_bytes(), said.as_bytes());
        a.len() == b.len() && a.iter().zip(b).fold(0, |acc, (x, y)| acc | (x ^ y)) == 0
    }

    /// Writes it to a new file that only this user can read, in the place of the old
    /// one if there is one.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn write(&self, path: &Path) -> Result<(), TokenError> {
        let line = format!("{}\n", self.0);
        replace_private_file(path, line.as_bytes()).map_err(|cause| TokenError::File {
            path: path.to_owned(),
            cause,
        })
    }

    /// Reads it from a file.
    ///
    /// # Errors
    /// When the file cannot be read or holds no token.
    pub fn read(path: &Path) -> Result<Self, TokenError> {
        let file = |cause| TokenError::File {
            path: path.to_owned(),
            cause,
        };
        let text = std::fs::read_to_string(path).map_err(file)?;
        let none = || std::io::Error::new(ErrorKind::InvalidData, "it holds no token");
        Self::told(text.trim()).ok_or_else(|| file(none()))
    }
}

impl core::fmt::Debug for Token {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("Token(…)")
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::os::unix::fs::PermissionsExt;

    #[test]
    fn tokens_differ_and_nothing_else_is_one() {
        let (a, b) = (Token::draw().unwrap(), Token::draw().unwrap());
        assert_ne!(a, b);
        assert_eq!(a.secret().len(), 2 * DRAWN_BYTES);
        assert!(a.is(a.secret()) && !a.is(b.secret()) && !a.is(""));
        assert!(!a.is(&a.secret()[1..]));
        assert!(!format!("{a:?}").contains(a.secret()));
        for wrong in ["", "two words", "nul\0", &"a".repeat(MAX_TOKEN_CHARS + 1)] {
            assert_eq!(Token::told(wrong), None, "{wrong:?}");
        }
    }

    #[test]
    fn only_this_user_can_read_the_file_whatever_was_there() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("token");
        std::fs::write(&path, "an old one that all could read").unwrap();
        std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o644)).unwrap();
        let token = Token::draw().unwrap();
        token.write(&path).unwrap();
        let mode = std::fs::metadata(&path).unwrap().permissions().mode();
        assert_eq!(mode & 0o777, 0o600);
        assert_eq!(Token::read(&path).unwrap(), token);
        std::fs::write(&path, "no token at all").unwrap();
        assert!(Token::read(&path).is_err());
        assert!(Token::read(&dir.path().join("gone")).is_err());
    }
}

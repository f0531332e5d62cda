//! What the operator of a ground station said last, kept over its restarts: the
//! standing order, the tasks that were asked for, and the mission that replaced the configured one.
//!
//! A record of a later life voids those of earlier ones, at every peer. So a ground
//! station that came back knowing only its configuration would silence the operator.
//! The file lies beside the journal and is replaced as a whole, before anything of it
//! is spoken. It counts only for the mission that was configured when it was written:
//! whoever configures another one begins anew.

use serde::{Deserialize, Serialize};
use skein_behaviors::{Order, Orders};
use skein_console::replace_private_file;
use skein_peer::Mission;
use skein_peer::input::{AskedTask, OperatorsTasks};
use skein_peer::wire::tasks::DoneTask;
use std::collections::BTreeMap;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Why what the operator said cannot be kept or read back.
#[derive(Debug, thiserror::Error)]
pub enum StandingError {
    /// The file cannot be written or read.
    #[error("{path}: {cause}")]
    Io {
        /// Which.
        path: PathBuf,
        /// Why.
        cause: std::io::Error,
    },
    /// The file is not what was written.
    #[error("{path} cannot be read: {cause}; remove it to begin with the configured mission")]
    Malformed {
        /// Which.
        path: PathBuf,
        /// Why.
        cause: serde_json::Error,
    },
}

/// What the operator said last.
#[derive(Debug)]
pub struct Standing {
    path: PathBuf,
    kept: Kept,
}

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
struct Kept {
    /// Content hash of the configured mission, 0 for none.
    configured: u64,
    order: Option<Order>,
    #[serde(default)]
    singles: BTreeMap<u16, Order>,
    mission: Option<Arc<Mission>>,
    #[serde(default)]
    tasks: Vec<AskedTask>,
    #[serde(default)]
    done: Vec<DoneTask>,
}

impl Standing {
    /// Reads what stands beside the journal at `journal`, if anything does.
    ///
    /// # Errors
    /// When there is a file that cannot be read.
    pub fn open(journal: &Path, configured: Option<&Mission>) -> Result<Self, StandingError> {
        let mut path = journal.as_os_str().to_owned();
        path.push(".operator");
        let path = PathBuf::from(path);
        let configured = configured.map_or(0, Mission::content_hash);
        let begun = Kept {
            configured,
            ..Kept::default()
        };
        let kept = match std::fs::read(&path) {
            Err(cause) if cause.kind() == ErrorKind::NotFound => begun,
            Err(cause) => return Err(StandingError::Io { path, cause }),
            Ok(bytes) => match serde_json::from_slice::<Kept>(&bytes) {
                Ok(kept) if kept.configured == configured => kept,
                Ok(_) => {
                    tracing::warn!(
                        path = %path.display(),
                        "another mission is configured than when the operator spoke last: what was said then does not stand any more"
                    );
                    begun
                }
                Err(cause) => return Err(StandingError::Malformed { path, cause }),
            },
        };
        Ok(Self { path, kept })
    }

    /// The standing orders.
    #[must_use]
    pub fn orders(&self) -> Option<Orders> {
        let all = self.kept.order?;
        let singles = self.kept.singles.clone();
        Some(Orders { all, singles }).filter(Orders::is_bounded)
    }

    /// The mission that replaced the configured one.
    #[must_use]
    pub fn mission(&self) -> Option<Arc<Mission>> {
        self.kept.mission.clone()
    }

    /// What the operator said of tasks, as it was said last.
    #[must_use]
    pub fn tasks(&self) -> OperatorsTasks {
        OperatorsTasks {
            asked: self.kept.tasks.clone(),
            done: self.kept.done.clone(),
        }
    }

    /// Keeps tasks.
    ///
    /// # Errors
    /// When it cannot be written; those before stand.
    pub fn keep_tasks(&mut self, tasks: OperatorsTasks) -> Result<(), StandingError> {
        self.keep(Kept {
            tasks: tasks.asked,
            done: tasks.done,
            ..self.kept.clone()
        })
    }

    /// Keeps orders.
    ///
    /// # Errors
    /// When it cannot be written; those before stand.
    pub fn keep_orders(&mut self, orders: Orders) -> Result<(), StandingError> {
        self.keep(Kept {
            order: Some(orders.all),
            singles: orders.singles,
            ..self.kept.clone()
        })
    }

    /// Keeps a mission.
    ///
    /// # Errors
    /// When it cannot be written; the one before stands.
    pub fn keep_mission(&mut self, mission: Arc<Mission>) -> Result<(), StandingError> {
        self.keep(Kept {
            mission: Some(mission),
            ..self.kept.clone()
        })
    }

    fn keep(&mut self, kept: Kept) -> Result<(), StandingError> {
        let io = |cause| StandingError::Io {
            path: self.path.clone(),
            cause,
        };
        let json = serde_json::to_vec(&kept).map_err(|e| io(e.into()))?;
        replace_private_file(&self.path, &json).map_err(io)?;
        self.kept = kept;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::mission;
    use skein_peer::wire::tasks::TaskId;

    #[test]
    fn what_was_said_last_stands_until_another_mission_is_configured() {
        let dir = tempfile::tempdir().unwrap();
        let journal = dir.path().join("j");
        let configured = mission();
        let open = |mission: &Mission| Standing::open(&journal, Some(mission)).unwrap();
        let mut standing = open(&configured);
        assert_eq!((standing.orders(), standing.mission()), (None, None));
        let revised = Arc::new(Mission {
            revision: 4,
            ..mission()
        });
        standing.keep_orders(Order::Hold.into()).unwrap();
        standing.keep_mission(Arc::clone(&revised)).unwrap();
        standing.keep_orders(Order::ReturnToBase.into()).unwrap();
        let task = TaskId {
            author: 3,
            number: 1,
        };
        let said = OperatorsTasks {
            asked: Vec::new(),
            done: vec![DoneTask { task, revision: 2 }],
        };
        standing.keep_tasks(said.clone()).unwrap();
        let again = open(&configured);
        assert_eq!(again.tasks(), said);
        assert_eq!(again.orders(), Some(Order::ReturnToBase.into()));
        assert_eq!(again.mission(), Some(revised));
        let other = Mission {
            base: (1, 1),
            ..mission()
        };
        let anew = open(&other);
        assert_eq!((anew.orders(), anew.mission()), (None, None));
        assert!(anew.tasks().is_empty());
    }

    #[test]
    fn what_cannot_be_kept_or_read_is_an_error_that_names_the_file() {
        let dir = tempfile::tempdir().unwrap();
        let mut standing = Standing::open(&dir.path().join("gone/j"), None).unwrap();
        let error = standing
            .keep_orders(Order::Hold.into())
            .unwrap_err()
            .to_string();
        assert!(error.contains("j.operator"), "{error}");
        assert_eq!(standing.orders(), None);
        std::fs::write(dir.path().join("j.operator"), "{").unwrap();
        let error = Standing::open(&dir.path().join("j"), None).unwrap_err();
        assert!(matches!(error, StandingError::Malformed { .. }), "{error}");
    }
}

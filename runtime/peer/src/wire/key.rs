//! Natural keys.

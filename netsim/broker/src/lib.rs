//! The simulated world and radio around live peers.

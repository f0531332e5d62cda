//! What is held, passed on and sent, and when.

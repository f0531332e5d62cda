//! Path following: a curve and a pose in, timed turns out.

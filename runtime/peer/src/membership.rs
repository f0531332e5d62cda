//! Who is alive: the failure detector.

//! The frames of the vehicle stream between a node and its world.

//! The world and the radio around a swarm, in virtual time.

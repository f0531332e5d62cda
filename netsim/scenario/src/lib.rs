//! A scenario file, resolved: mission, world, fleet, radio, faults, storm, checks.

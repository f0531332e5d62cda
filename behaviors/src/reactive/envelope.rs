//! The envelope: stall, bank, zones; the last word on every setpoint.

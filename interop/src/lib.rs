//! The formats of the outside world: QGroundControl plans and GeoJSON.

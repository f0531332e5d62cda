//! The body of one peer: the asynchronous shell around the mind, and the only user of Zenoh.

//! What is counted beside what is true, on scenes made by hand.

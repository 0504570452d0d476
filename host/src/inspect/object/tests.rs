//! What a check says of objects that are good, odd, and none.

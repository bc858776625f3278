//! The first outputs of every stream, pinned: a change here changes every published number.

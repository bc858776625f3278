//! Lists in which nothing is twice.

/// Removes repetitions; the order of first occurrence stays.
pub(crate) fn each_once<T: PartialEq>(items: impl IntoIterator<Item = T>) -> Vec<T> {
    let mut once = Vec::new();
    for item in items {
        push(&mut once, &[], item);
    }
    once
}

/// Adds the items that the list does not have yet.
pub(crate) fn extend<T: Clone + PartialEq>(list: &mut Vec<T>, items: &[T]) {
    for item in items {
        push(list, &[], item.clone());
    }
}

/// Adds an item that is in neither list.
pub(crate) fn push<T: PartialEq>(list: &mut Vec<T>, known: &[T], item: T) {
    if !known.contains(&item) && !list.contains(&item) {
        list.push(item);
    }
}

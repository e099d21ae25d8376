//! The values used last.

use std::convert::Infallible;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// A few values by key. A value is built by the first thread that asks for it; others that want the same wait for it,
/// those that want another do not.
pub struct Cache<K, V> {
    capacity: usize,
    /// Most recently used last.
    slots: Mutex<Vec<(K, Slot<V>)>>,
}

type Slot<V> = Arc<Mutex<Option<Arc<V>>>>;

impl<K: PartialEq, V> Cache<K, V> {
    /// At most `capacity` values; what was used longest ago makes room.
    pub fn new(capacity: usize) -> Self {
        Self { capacity, slots: Mutex::default() }
    }

    /// The value of `key`, made if it is not there. A failure is not kept.
    pub fn get<E>(&self, key: K, make: impl FnOnce() -> Result<V, E>) -> Result<Arc<V>, E> {
        let slot = self.slot(key);
        let mut value = lock(&slot);
        if let Some(value) = &*value {
            return Ok(value.clone());
        }
        let made = Arc::new(make()?);
        *value = Some(made.clone());
        Ok(made)
    }

    /// The same of a value whose making cannot fail.
    pub fn made(&self, key: K, make: impl FnOnce() -> V) -> Arc<V> {
        self.get(key, || Ok::<V, Infallible>(make())).unwrap_or_else(|never| match never {})
    }

    fn slot(&self, key: K) -> Slot<V> {
        let mut slots = lock(&self.slots);
        // What was used last is asked for most.
        let entry = match slots.iter().rposition(|(k, _)| *k == key) {
            Some(i) => slots.remove(i),
            None => {
                if slots.len() == self.capacity {
                    slots.remove(0);
                }
                (key, Slot::default())
            }
        };
        let slot = entry.1.clone();
        slots.push(entry);
        slot
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cache_keeps_what_was_used_last() {
        let cache: Cache<u32, u32> = Cache::new(2);
        let mut made = vec![];
        let mut ask = |key: u32| {
            let value = cache.get(key, || {
                made.push(key);
                Ok::<u32, ()>(key * 10)
            });
            assert_eq!(*value.unwrap(), key * 10);
        };
        [1, 2, 1, 3, 1, 2].into_iter().for_each(&mut ask);
        assert_eq!(made, [1, 2, 3, 2], "3 pushed 2 out, not 1");
        assert_eq!(cache.get(9, || Err("x")), Err("x"));
        assert_eq!(*cache.get(9, || Ok::<u32, ()>(90)).unwrap(), 90, "a failure is not kept");
    }
}

//! The border: the pointers that a C caller passes, and nearly all of the code that trusts them.
//!
//! Only the functions of the header use these traits, with the pointers that C passed. The header states the contract:
//! a pointer is null, or it points to as much as its function says, for as long as it says. Null, misalignment, an
//! object of another kind and an object in use are detected here, and become codes.

// Requirements: P-04, P-06

use core::cell::UnsafeCell;
use core::ffi::c_void;
#[cfg(not(target_os = "none"))]
use core::ffi::{CStr, c_char};
use core::ops::{Deref, DerefMut};
use core::slice;
use core::sync::atomic::{AtomicU32, Ordering};

use bytemuck::AnyBitPattern;
use heapless::Vec;

use crate::code::dibs_code;

/// Alignment, in bytes, of the storage of every object: a computer's cipher needs that much.
pub const DIBS_ALIGNMENT: usize = 16;

/// A type for which any bits are a valid value.
///
/// # Safety
/// Any bits must be a valid value of the type.
pub unsafe trait AnyBits: Copy {}

// SAFETY: `AnyBitPattern` promises the same.
unsafe impl<T: AnyBitPattern> AnyBits for T {}

/// A pointer to one or several values that are read.
pub trait Input<T>: Sized {
    /// A copy of the value.
    fn get(self) -> Result<T, dibs_code>;

    /// The same, or `None` for a null pointer.
    fn get_if_any(self) -> Result<Option<T>, dibs_code>;

    /// Several values, which are valid as long as the header says.
    fn slice(self, count: usize) -> Result<&'static [T], dibs_code>
    where
        T: 'static;
}

impl<T: AnyBits> Input<T> for *const T {
    fn get(self) -> Result<T, dibs_code> {
        check(self)?;
        // SAFETY: neither null nor misaligned, so the caller promises a value; any bits are a valid one.
        Ok(unsafe { self.read() })
    }

    fn get_if_any(self) -> Result<Option<T>, dibs_code> {
        if self.is_null() { Ok(None) } else { self.get().map(Some) }
    }

    fn slice(self, count: usize) -> Result<&'static [T], dibs_code>
    where
        T: 'static,
    {
        check(self)?;
        if count > isize::MAX as usize / size_of::<T>().max(1) {
            return Err(dibs_code::Argument);
        }
        // SAFETY: neither null nor misaligned, so the caller promises `count` values that nobody changes.
        Ok(unsafe { slice::from_raw_parts(self, count) })
    }
}

/// A pointer to memory for one or several values that are written.
pub trait Output<T>: Sized {
    /// The memory, if the pointer is valid: checked before any work is done.
    fn check(self) -> Result<Out<T>, dibs_code>;

    /// The same, or `None` for a null pointer.
    fn check_if_any(self) -> Result<Option<Out<T>>, dibs_code>;

    /// Contiguous memory for several values.
    fn places(self, count: usize) -> Result<OutSlice<T>, dibs_code>;
}

impl<T> Output<T> for *mut T {
    fn check(self) -> Result<Out<T>, dibs_code> {
        check(self)?;
        Ok(Out(self))
    }

    fn check_if_any(self) -> Result<Option<Out<T>>, dibs_code> {
        if self.is_null() { Ok(None) } else { self.check().map(Some) }
    }

    fn places(self, count: usize) -> Result<OutSlice<T>, dibs_code> {
        check(self)?;
        Ok(OutSlice { next: self, left: count })
    }
}

/// Memory for a value, after its check.
pub struct Out<T>(*mut T);

impl<T> Out<T> {
    /// Writes the value.
    pub fn set(self, value: T) {
        // SAFETY: the pointer was checked, and the caller promises that only this call uses the memory.
        unsafe { self.0.write(value) };
    }

    /// Writes the value, unless the pointer was null.
    pub fn set_if_any(place: Option<Self>, value: T) {
        if let Some(place) = place {
            place.set(value);
        }
    }

    /// The value that is there.
    pub fn get(&self) -> T
    where
        T: AnyBits,
    {
        // SAFETY: the pointer was checked, and the function's contract requires a value there; any bits are a valid
        // one.
        unsafe { self.0.read() }
    }
}

/// Memory for several values, of which the first are written.
pub struct OutSlice<T> {
    next: *mut T,
    left: usize,
}

impl<T> OutSlice<T> {
    /// Writes the next value.
    pub fn push(&mut self, value: T) -> Result<(), dibs_code> {
        self.left = self.left.checked_sub(1).ok_or(dibs_code::Capacity)?;
        // SAFETY: the caller promises memory for as many values as requested, which only this call uses.
        unsafe {
            self.next.write(value);
            self.next = self.next.add(1);
        }
        Ok(())
    }

    /// Writes all values, or none if there is too little memory. Returns their number.
    pub fn fill(mut self, values: &[T]) -> Result<usize, dibs_code>
    where
        T: Copy,
    {
        if values.len() > self.left {
            return Err(dibs_code::Capacity);
        }
        for &value in values {
            self.push(value)?;
        }
        Ok(values.len())
    }
}

/// The caller's memory in which an object is created.
pub trait Storage {
    /// Creates an object in memory of `size` bytes, and writes its address to `out`.
    fn make<T: Kind>(
        self,
        size: usize,
        out: *mut *mut T,
        body: impl FnOnce() -> Result<T, dibs_code>,
    ) -> Result<(), dibs_code>;

    /// Zeroed words after the first `offset` bytes, which are a multiple of 4.
    fn words(
        self,
        size: usize,
        offset: usize,
        words: usize,
    ) -> Result<&'static mut [u32], dibs_code>;

    /// Stores a value after the first `offset` bytes, which are a multiple of its alignment.
    fn keep<T>(self, size: usize, offset: usize, value: T) -> Result<&'static T, dibs_code>;
}

/// The start of the memory, if it is large enough and aligned.
fn memory(storage: *mut c_void, size: usize, needed: usize) -> Result<*mut c_void, dibs_code> {
    if storage.is_null() {
        Err(dibs_code::Null)
    } else if !storage.addr().is_multiple_of(DIBS_ALIGNMENT) {
        Err(dibs_code::StorageAlignment)
    } else if size < needed {
        Err(dibs_code::StorageSize)
    } else {
        Ok(storage)
    }
}

impl Storage for *mut c_void {
    fn make<T: Kind>(
        self,
        size: usize,
        out: *mut *mut T,
        body: impl FnOnce() -> Result<T, dibs_code>,
    ) -> Result<(), dibs_code> {
        const { assert!(size_of::<Object<T>>() <= T::SIZE) };
        const { assert!(align_of::<Object<T>>() <= DIBS_ALIGNMENT) };
        let out = out.check()?;
        let place = memory(self, size, T::SIZE)?.cast::<Object<T>>();
        // The mark is cleared while the object is created, so that nobody uses it half-made.
        // SAFETY: large enough and aligned, and the caller gives it up.
        unsafe { (&raw mut (*place).mark).write(AtomicU32::new(0)) };
        let body = body()?;
        // SAFETY: the same.
        unsafe { (&raw mut (*place).body).write(UnsafeCell::new(body)) };
        // SAFETY: both fields are written.
        unsafe { &*place }.mark.store(T::MARK, Ordering::Release);
        out.set(place.cast());
        Ok(())
    }

    fn words(
        self,
        size: usize,
        offset: usize,
        words: usize,
    ) -> Result<&'static mut [u32], dibs_code> {
        let bytes = words.checked_mul(4).and_then(|bytes| bytes.checked_add(offset));
        let needed = bytes.filter(|_| offset.is_multiple_of(4)).ok_or(dibs_code::Argument)?;
        let start = memory(self, size, needed)?.cast::<u32>();
        // SAFETY: inside the caller's memory, which belongs to this object alone from now on.
        unsafe {
            let start = start.add(offset / 4);
            start.write_bytes(0, words);
            Ok(slice::from_raw_parts_mut(start, words))
        }
    }

    fn keep<T>(self, size: usize, offset: usize, value: T) -> Result<&'static T, dibs_code> {
        const { assert!(align_of::<T>() <= DIBS_ALIGNMENT) };
        let needed = size_of::<T>().checked_add(offset);
        let needed = needed.filter(|_| offset.is_multiple_of(align_of::<T>()));
        let start = memory(self, size, needed.ok_or(dibs_code::Argument)?)?;
        // SAFETY: inside the caller's memory and aligned; it belongs to this object alone from now on.
        unsafe {
            let place = start.byte_add(offset).cast::<T>();
            place.write(value);
            Ok(&*place)
        }
    }
}

/// A kind of object, such as a tree or a query.
pub trait Kind: 'static {
    /// The number that marks an object of this kind.
    const MARK: u32;
    /// Bytes of storage, as the header states them.
    const SIZE: usize;
}

/// An object in the caller's storage.
#[repr(C)]
struct Object<T> {
    mark: AtomicU32,
    body: UnsafeCell<T>,
}

/// The address of an object, as its constructor returned it.
pub trait Handle<T: Kind> {
    /// Opens the object for exclusive use by this call.
    fn open(self) -> Result<Open<T>, dibs_code>;

    /// Moves the object out of its storage, which then holds none.
    fn take(self) -> Result<T, dibs_code>;

    /// The object, shared with other contexts. Only for kinds that are never opened.
    fn share(self) -> Result<&'static T, dibs_code>
    where
        T: Sync;
}

/// This bit of the mark means that the object is in use.
const IN_USE: u32 = 1;

impl<T: Kind> Handle<T> for *mut T {
    fn open(self) -> Result<Open<T>, dibs_code> {
        let in_use = T::MARK ^ IN_USE;
        match mark(self)?.compare_exchange(T::MARK, in_use, Ordering::Acquire, Ordering::Relaxed) {
            Ok(_) => Ok(Open(self.cast())),
            Err(found) if found == in_use => Err(dibs_code::InUse),
            Err(_) => Err(dibs_code::NotInitialised),
        }
    }

    fn take(self) -> Result<T, dibs_code> {
        let object = self.open()?;
        // SAFETY: replacing its mark excludes all other users, now and from now on.
        let body = unsafe { (*object.0).body.get().read() };
        // SAFETY: the caller keeps the storage.
        unsafe { &*object.0 }.mark.store(0, Ordering::Release);
        core::mem::forget(object);
        Ok(body)
    }

    fn share(self) -> Result<&'static T, dibs_code>
    where
        T: Sync,
    {
        if mark(self)?.load(Ordering::Acquire) != T::MARK {
            return Err(dibs_code::NotInitialised);
        }
        let object = self.cast::<Object<T>>();
        // SAFETY: its mark proves that it was created here, and the caller keeps its storage. Objects of this kind are
        // never opened.
        Ok(unsafe { &*(*object).body.get() })
    }
}

/// The addresses of several objects, in an array.
pub trait Handles<T: Kind> {
    /// Opens one to `N` objects for exclusive use by this call. An object that is listed twice is in use.
    fn open_all<const N: usize>(self, count: u32) -> Result<Vec<Open<T>, N>, dibs_code>;
}

impl<T: Kind> Handles<T> for *const *mut T {
    fn open_all<const N: usize>(self, count: u32) -> Result<Vec<Open<T>, N>, dibs_code> {
        check(self)?;
        let count = some_of::<N>(count)?;
        let mut objects = Vec::new();
        for at in 0..count {
            // SAFETY: neither null nor misaligned, so the caller promises `count` addresses.
            let object = unsafe { self.add(at).read() };
            objects.push(object.open()?).map_err(|_| dibs_code::Argument)?;
        }
        Ok(objects)
    }
}

/// A count that must be from one to `N`.
pub fn some_of<const N: usize>(count: u32) -> Result<usize, dibs_code> {
    Some(count as usize).filter(|count| (1..=N).contains(count)).ok_or(dibs_code::Argument)
}

/// The mark of an object, or of storage without an object.
fn mark<T: Kind>(object: *mut T) -> Result<&'static AtomicU32, dibs_code> {
    let mark = object.cast::<AtomicU32>();
    check(mark)?;
    // SAFETY: neither null nor misaligned, so the caller promises an object or storage for one; any bits are a valid
    // word.
    Ok(unsafe { &*mark })
}

/// An object that is in use until this is dropped.
pub struct Open<T: Kind>(*mut Object<T>);

impl<T: Kind> Deref for Open<T> {
    type Target = T;

    fn deref(&self) -> &T {
        // SAFETY: its mark proved that it was created here, and excludes all other users.
        unsafe { &*(*self.0).body.get() }
    }
}

impl<T: Kind> DerefMut for Open<T> {
    fn deref_mut(&mut self) -> &mut T {
        // SAFETY: as above.
        unsafe { &mut *(*self.0).body.get() }
    }
}

impl<T: Kind> Drop for Open<T> {
    fn drop(&mut self) {
        // SAFETY: as above.
        unsafe { &*self.0 }.mark.store(T::MARK, Ordering::Release);
    }
}

fn check<T>(pointer: *const T) -> Result<(), dibs_code> {
    if pointer.is_null() {
        Err(dibs_code::Null)
    } else if !pointer.is_aligned() {
        Err(dibs_code::Misaligned)
    } else {
        Ok(())
    }
}

/// A zero-terminated text.
#[cfg(not(target_os = "none"))]
pub fn text(pointer: *const c_char) -> Result<&'static str, dibs_code> {
    check(pointer)?;
    // SAFETY: not null, so the caller promises a terminating zero.
    let text = unsafe { CStr::from_ptr(pointer) };
    text.to_str().map_err(|_| dibs_code::Argument)
}

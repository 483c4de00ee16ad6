//! Pointers of the caller as references, slices and texts. A null pointer is a fault of the call.

use crate::fault::CallFault;
use std::ffi::{CStr, c_char};

/// The object behind a handle.
///
/// # Safety
/// `pointer` is null, or a handle that is valid for the call.
pub(crate) unsafe fn reference<'a, T>(pointer: *const T, name: &str) -> Result<&'a T, CallFault> {
    // SAFETY: by the contract of this function.
    unsafe { pointer.as_ref() }.ok_or_else(|| null(name))
}

/// The object behind a handle or structure of the caller, to be changed.
///
/// # Safety
/// `pointer` is null, or valid for writes and used by no other thread during the call.
pub(crate) unsafe fn output<'a, T>(pointer: *mut T, name: &str) -> Result<&'a mut T, CallFault> {
    // SAFETY: by the contract of this function.
    unsafe { pointer.as_mut() }.ok_or_else(|| null(name))
}

/// A place for a result, which may hold anything before.
pub(crate) fn place<T>(pointer: *mut T, name: &str) -> Result<*mut T, CallFault> {
    if pointer.is_null() { Err(null(name)) } else { Ok(pointer) }
}

/// An array to read. Its length 0 permits a null pointer.
///
/// # Safety
/// `pointer` is null, or points to `length` initialized values.
pub(crate) unsafe fn array<'a, T>(pointer: *const T, length: usize, name: &str) -> Result<&'a [T], CallFault> {
    match (pointer.is_null(), length) {
        (_, 0) => Ok(&[]),
        (true, _) => Err(null(name)),
        // SAFETY: the pointer is not null, and the contract of this function holds for the rest.
        (false, _) => Ok(unsafe { std::slice::from_raw_parts(pointer, length) }),
    }
}

/// Copies values to an array of the caller, unless it is null.
///
/// # Safety
/// `pointer` is null, or valid for writes of as many values, and overlaps none of them.
pub(crate) unsafe fn fill<T: Copy>(pointer: *mut T, values: &[T]) {
    if !pointer.is_null() {
        // SAFETY: by the contract of this function.
        unsafe { std::ptr::copy_nonoverlapping(values.as_ptr(), pointer, values.len()) }
    }
}

/// A text of the caller.
///
/// # Safety
/// `pointer` is null, or points to bytes that end with a zero byte.
pub(crate) unsafe fn text<'a>(pointer: *const c_char, name: &str) -> Result<&'a str, CallFault> {
    if pointer.is_null() {
        return Err(null(name));
    }
    // SAFETY: by the contract of this function.
    let text = unsafe { CStr::from_ptr(pointer) };
    text.to_str().map_err(|_| CallFault::argument(format!("`{name}` is not UTF-8")))
}

/// A list of texts.
///
/// # Safety
/// `pointer` is null, or points to `length` pointers, each as [`text`] requires.
pub(crate) unsafe fn texts(pointer: *const *const c_char, length: usize, name: &str) -> Result<Vec<String>, CallFault> {
    // SAFETY: by the contract of this function.
    let pointers = unsafe { array(pointer, length, name) }?;
    // SAFETY: by the contract of this function.
    pointers.iter().map(|one| Ok(unsafe { text(*one, name) }?.to_owned())).collect()
}

/// Releases a handle.
///
/// # Safety
/// `pointer` is null, or was made by `Box::into_raw` and is not used again.
pub(crate) unsafe fn release<T>(pointer: *mut T) {
    if !pointer.is_null() {
        // SAFETY: by the contract of this function.
        drop(unsafe { Box::from_raw(pointer) });
    }
}

fn null(name: &str) -> CallFault {
    CallFault::argument(format!("`{name}` is a null pointer"))
}

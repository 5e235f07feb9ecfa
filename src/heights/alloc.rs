//! Limits on sample counts, checked before memory is taken.

use super::HeightError;

/// Number of samples of a `width` x `height` raster.
///
/// Errors: `TooSmall` under 2 x 2, `TooLarge` over `limit` or over the address space.
pub(crate) fn sample_count(subject: &str, width: u64, height: u64, limit: u64) -> Result<usize, HeightError> {
    if width < 2 || height < 2 {
        return Err(HeightError::TooSmall { subject: subject.to_owned(), width, height });
    }
    width
        .checked_mul(height)
        .filter(|&n| n <= limit && n <= (isize::MAX as u64) / 8)
        .and_then(|n| usize::try_from(n).ok())
        .ok_or_else(|| HeightError::TooLarge { subject: subject.to_owned(), width, height, limit })
}

/// Refuses a raster to be read in rectangles whose sides are under 2 (`TooSmall`) or over
/// `i32::MAX` samples (`SideTooLong`).
pub(crate) fn sides(subject: &str, width: u64, height: u64) -> Result<(), HeightError> {
    let subject = || subject.to_owned();
    if width < 2 || height < 2 {
        return Err(HeightError::TooSmall { subject: subject(), width, height });
    }
    if width.max(height) > i32::MAX as u64 {
        return Err(HeightError::SideTooLong { subject: subject(), width, height });
    }
    Ok(())
}

/// `count` copies of the all-zero value of `T`; errors with `OutOfMemory` instead of aborting.
pub(crate) fn zeroed<T: Clone + Default>(subject: &str, count: usize) -> Result<Vec<T>, HeightError> {
    // Only a trial: `vec!` of zeros gets untouched pages from the system, which filling a
    // reserved vector would not, and sparse files are mostly untouched.
    let mut trial: Vec<T> = Vec::new();
    trial.try_reserve_exact(count).map_err(|_| HeightError::OutOfMemory {
        subject: subject.to_owned(),
        bytes: (count as u64).saturating_mul(size_of::<T>() as u64),
    })?;
    drop(trial);
    Ok(vec![T::default(); count])
}

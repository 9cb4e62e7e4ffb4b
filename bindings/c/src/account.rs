//! An account of the energy that a wall gives.

use core::ffi::c_void;

use dibs_nostd::constraint::{EnergyAccount, SpringDamper};

use crate::border::{Handle, Kind, Output, Storage};
use crate::code::dibs_code;
use crate::tool::dibs_vec3;

/// Bytes of an account's storage.
pub const DIBS_ACCOUNT_SIZE: usize = 64;

/// An account of the energy that a wall's force gives to the hand, relative to the wall. It limits the force's steps, and
/// reduces the force where the energy given would exceed the energy received by more than a stated tank. If the relative
/// velocity leaps outwards, the force falls in steps, and the wall gives more. At speeds up to the stated one, all this
/// together is at most `speed * period * (F + step / 2)^2 / (2 * step)` for the largest force `F`. An account that has
/// used it up recovers by a tenth of the tank per second, up to an eighth, so that the wall keeps a force.
///
/// One context at a time.
pub struct dibs_account(EnergyAccount);

impl Kind for dibs_account {
    const MARK: u32 = 0x6462_651E;
    const SIZE: usize = DIBS_ACCOUNT_SIZE;
}

/// Makes an account with a full tank.
///
/// @param storage    `DIBS_ACCOUNT_SIZE` bytes, aligned to `DIBS_ALIGNMENT`.
/// @param size       Bytes of the storage.
/// @param tank       Energy (mJ) that may be given beyond the energy received, above 0.
/// @param step       Largest change of the force per tick (N), above 0.
/// @param stiffness  Stiffness of the wall (N/mm), above 0.
/// @param max_force  Largest force of the wall (N), above 0.
/// @param speed      Largest speed (mm/s) of the tool relative to the wall, above 0. Of a faster motion only this speed
///                   is counted.
/// @param account    Receives the account's address.
/// @return `DIBS_CODE_OK`, `DIBS_CODE_GAIN`, or a misuse.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_account_init(
    storage: *mut c_void,
    size: usize,
    tank: f32,
    step: f32,
    stiffness: f32,
    max_force: f32,
    speed: f32,
    account: *mut *mut dibs_account,
) -> dibs_code {
    dibs_code::of(|| {
        storage.make(size, account, || {
            let spring = SpringDamper::stiffness(stiffness).max_force(max_force);
            Ok(dibs_account(EnergyAccount::new(tank, step, &spring, speed)?))
        })
    })
}

/// The force to apply for the next period, for the force that `dibs_wall_force`, `dibs_wall_proxy_force` or
/// `dibs_answer_force` computed. Call it at every tick, during a hold too.
///
/// If a number or its square is not finite, the force falls to zero in steps; a velocity that is not counts as one
/// along the force at the largest speed.
///
/// @param account   The account.
/// @param force     The computed force (N).
/// @param velocity  Velocity (mm/s) of the tool relative to the wall since the last tick, as for the wall's force.
/// @param period    The period, in s.
/// @param applied   Receives the force to apply (N); always finite. May be the computed one's memory.
/// @return `DIBS_CODE_OK`, or a misuse.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_account_pass(
    account: *mut dibs_account,
    force: dibs_vec3,
    velocity: dibs_vec3,
    period: f32,
    applied: *mut dibs_vec3,
) -> dibs_code {
    dibs_code::of(|| {
        let (applied, mut account) = (applied.check()?, account.open()?);
        applied.set(account.0.pass(force.into(), velocity.into(), period).into());
        Ok(())
    })
}

/// The energy (mJ) that may still be given; below 0 after an overdraft.
///
/// @param account  The account.
/// @param balance  Receives it.
/// @return `DIBS_CODE_OK`, or a misuse.
#[unsafe(no_mangle)]
pub extern "C" fn dibs_account_balance(account: *mut dibs_account, balance: *mut f32) -> dibs_code {
    dibs_code::of(|| {
        let (balance, account) = (balance.check()?, account.open()?);
        balance.set(account.0.balance());
        Ok(())
    })
}

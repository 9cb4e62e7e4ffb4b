//! The accuracy that a demo's answer is compared with.

// Requirement: E-02

use dibs_prove::demo::check::without;

#[test]
fn an_accuracy_below_the_position_errors_last_digit_is_not_lost() {
    for error in [0.0_f32, 1e-6, 1e-3, 0.7] {
        for own in [1e-12_f32, 3e-8, 1e-5] {
            let found = without(own + error, error);
            assert!(found >= f64::from(own) && found.is_finite(), "{own} of {error}: {found}");
        }
    }
}

//! Intervals of counted shares.

/// Wilson's interval (1927) of a share, 95 %.
pub(crate) fn wilson(k: u32, n: u32) -> [f64; 2] {
    let (k, n, z) = (f64::from(k), f64::from(n.max(1)), 1.96);
    let (middle, half) = ((k + z * z / 2.0) / (n + z * z), z / (n + z * z) * (k * (n - k) / n + z * z / 4.0).sqrt());
    [(middle - half).max(0.0), (middle + half).min(1.0)]
}

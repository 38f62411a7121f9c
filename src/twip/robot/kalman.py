"""The Kalman filter of pitch and gyro bias (paper, section 4.4)."""

from .kernel import kernel


@kernel
def predict(
    pitch: float,
    bias: float,
    variance: float,
    covariance: float,
    bias_variance: float,
    rate: float,
    elapsed: float,
    angle_noise: float,
    bias_noise: float,
) -> tuple[float, float, float, float, float]:
    """Carry the estimate over `elapsed` seconds of the measured rate.

        psi := psi + (rate - b) h,   b := b
        P   := F P F' + Q h,   F = [[1, -h], [0, 1]],   Q = diag(angle_noise, bias_noise)

    pitch psi in rad, bias b and rate in rad/s; variance P11 (rad2), covariance P12 (rad2/s), bias_variance P22
    (rad2/s2); elapsed h in s; angle_noise in rad2/s, bias_noise in rad2/s3. Returns psi, b, P11, P12, P22.
    """
    pitch = pitch + (rate - bias) * elapsed
    variance = variance - 2.0 * elapsed * covariance + elapsed * elapsed * bias_variance + angle_noise * elapsed
    covariance = covariance - elapsed * bias_variance
    return pitch, bias, variance, covariance, bias_variance + bias_noise * elapsed


@kernel
def correct(
    pitch: float,
    bias: float,
    variance: float,
    covariance: float,
    bias_variance: float,
    measurement: float,
    measurement_variance: float,
) -> tuple[float, float, float, float, float]:
    """Correct the estimate by a measured pitch.

        K = P H' / (H P H' + R),   x := x + K (z - psi),   P := (I - K H) P,   H = [1, 0]

    measurement z in rad, measurement_variance R in rad2; the rest as in `predict`.
    """
    total = variance + measurement_variance
    gain, bias_gain = variance / total, covariance / total
    innovation = measurement - pitch
    return (
        pitch + gain * innovation,
        bias + bias_gain * innovation,
        (1.0 - gain) * variance,
        (1.0 - gain) * covariance,
        bias_variance - bias_gain * covariance,
    )


@kernel
def measurement_variance(
    deviation: float,
    force: float,
    gravity: float,
    axle_acceleration: float,
    force_scale: float,
    acceleration_scale: float,
) -> float:
    """Return the variance (rad2) of the accelerometer's pitch, larger the less the sensor feels gravity alone.

        R = sigma^2 (1 + ((f - g) / (s_f g))^2) (1 + (a / s_a)^2)

    deviation sigma at rest in rad; force f, the magnitude of the specific force, and gravity g in m/s2;
    axle_acceleration a in m/s2; force_scale s_f without unit, acceleration_scale s_a in m/s2.
    """
    excess = (force - gravity) / (force_scale * gravity)
    motion = axle_acceleration / acceleration_scale
    return deviation * deviation * (1.0 + excess * excess) * (1.0 + motion * motion)

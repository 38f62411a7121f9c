"""What an inertial sensor on the body measures."""

from math import floor, sqrt

from .elementary import cos, sin_cos
from .kernel import kernel


@kernel
def specific_force(
    pitch: float,
    pitch_rate: float,
    pitch_acceleration: float,
    wheel_rate: float,
    wheel_acceleration: float,
    yaw_rate: float,
    yaw_acceleration: float,
    ground_slope: float,
    ground_slope_rate: float,
    gravity: float,
    wheel_radius: float,
    sensor_distance: float,
    sensor_elevation: float,
) -> tuple[float, float, float]:
    """Return the specific force (f_x forward, f_y left, f_z up, in m/s2) in body axes at the sensor.

    With the lean chi = psi + a off the ground's normal, the sensor sits at s = L_s cos(beta - chi) in front of the
    axle along the ground and at z = L_s sin(beta - chi) above it along the normal. Its acceleration, in axes along the
    heading, to the left and along the normal, is that of the axle plus that of the offset:

        a_t = R theta''                + z psi'' - s psi'^2 - s phi'^2
        a_y = R theta' phi'            + s phi'' + z phi' (2 psi' + a')
        a_n = R theta' a'              - s psi'' - z psi'^2
        f_x = a_t cos chi - a_n sin chi - g sin psi,   f_y = a_y,   f_z = a_t sin chi + a_n cos chi + g cos psi

    pitch psi, pitch_rate psi', pitch_acceleration psi'': rad and s, forward lean positive, 0 upright
    wheel_rate theta', wheel_acceleration theta'': mean absolute wheel angle, rad and s, rolling forward positive
    yaw_rate phi', yaw_acceleration phi'': rad and s, about the ground's normal, left turn positive
    ground_slope a, ground_slope_rate a': rad and s, uphill positive along the heading
    gravity g in m/s2, wheel_radius R in m, sensor_distance L_s in m, sensor_elevation beta in rad above the body's x
    axis

    Neglected: roll, the sensor's lateral offset. Extends paper eqs (43) and (44), whose two terms with sin carry the
    wrong sign for a sensor above the axle and which lack the axle's own acceleration.
    """
    lean = pitch + ground_slope
    sine, cosine = sin_cos(sensor_elevation - lean)
    along, above = sensor_distance * cosine, sensor_distance * sine
    a_t = (
        wheel_radius * wheel_acceleration
        + above * pitch_acceleration
        - along * pitch_rate * pitch_rate
        - along * yaw_rate * yaw_rate
    )
    a_y = (
        wheel_radius * wheel_rate * yaw_rate
        + along * yaw_acceleration
        + above * yaw_rate * (2.0 * pitch_rate + ground_slope_rate)
    )
    a_n = wheel_radius * wheel_rate * ground_slope_rate - along * pitch_acceleration - above * pitch_rate * pitch_rate
    sine, cosine = sin_cos(lean)
    sin_pitch, cos_pitch = sin_cos(pitch)
    f_x = a_t * cosine - a_n * sine - gravity * sin_pitch
    return f_x, a_y, a_t * sine + a_n * cosine + gravity * cos_pitch


@kernel
def angular_rate(pitch: float, pitch_rate: float, yaw_rate: float, ground_slope: float) -> tuple[float, float]:
    """Return the body's angular rate about its y axis (left) and its z axis (up), in rad/s.

    omega_y = psi',   omega_z = phi' cos(psi + a)

    The yaw rate phi' turns about the ground's normal, off which the body's z axis leans by the pitch psi and the slope
    a (rad); the rest of phi' falls on the x axis. No term of psi' leaves the y axis, for the axle stays level.
    """
    return pitch_rate, yaw_rate * cos(pitch + ground_slope)


@kernel
def noise_deviation(density: float, sample_time: float) -> float:
    """Return the standard deviation of sampled white noise of one-sided density `density` (unit/Hz^0.5).

    sigma = density sqrt(1 / (2 T_s)): sampled every T_s = sample_time (s), a signal holds the band up to 1 / (2 T_s).
    """
    return density * sqrt(0.5 / sample_time)


@kernel
def digitized(value: float, full_scale: float, resolution: float) -> float:
    """Return the nearest multiple of `resolution` (ties upwards) within +-full_scale; one unit for all."""
    limit = resolution * floor(full_scale / resolution)
    number = resolution * floor(value / resolution + 0.5)
    if number > limit:
        return limit
    if number < -limit:
        return -limit
    return number

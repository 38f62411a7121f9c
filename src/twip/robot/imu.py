"""What an inertial sensor on the body measures."""

from math import cos, floor, sin, sqrt

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

    The sensor sits at rho = L_s cos(beta - psi) in front of the axle and at zeta = L_s sin(beta - psi) above it, in
    axes that turn with the heading about the vertical. Its acceleration along them is that of the axle plus that of
    the offset:

        a_x = (R theta'' cos a - R theta' a' sin a) + rho''  - rho phi'^2
        a_y =  R theta' phi' cos a                  + rho phi'' + 2 rho' phi'
        a_z = (R theta'' sin a + R theta' a' cos a) + zeta''
        rho'  =  L_s sin(beta - psi) psi'
        rho''  =  L_s sin(beta - psi) psi'' - L_s cos(beta - psi) psi'^2
        zeta'' = -L_s cos(beta - psi) psi'' - L_s sin(beta - psi) psi'^2
        f_x = a_x cos psi - (a_z + g) sin psi,   f_y = a_y,   f_z = a_x sin psi + (a_z + g) cos psi

    pitch psi, pitch_rate psi', pitch_acceleration psi'': rad and s, forward lean positive, 0 upright
    wheel_rate theta', wheel_acceleration theta'': mean absolute wheel angle, rad and s, rolling forward positive
    yaw_rate phi', yaw_acceleration phi'': rad and s, about the vertical, left turn positive
    ground_slope a, ground_slope_rate a': rad and s, uphill positive along the heading
    gravity g in m/s2, wheel_radius R in m, sensor_distance L_s in m, sensor_elevation beta in rad above the body's x
    axis

    Neglected: roll, the sensor's lateral offset. Extends paper eqs (43) and (44), whose two terms with sin carry the
    wrong sign for a sensor above the axle and which lack the axle's own acceleration.
    """
    along, above = sensor_distance * cos(sensor_elevation - pitch), sensor_distance * sin(sensor_elevation - pitch)
    axle, normal = wheel_radius * wheel_acceleration, wheel_radius * wheel_rate * ground_slope_rate
    uphill, level = sin(ground_slope), cos(ground_slope)
    a_x = (
        axle * level
        - normal * uphill
        + above * pitch_acceleration
        - along * pitch_rate * pitch_rate
        - along * yaw_rate * yaw_rate
    )
    a_y = wheel_radius * wheel_rate * yaw_rate * level + along * yaw_acceleration + 2.0 * above * pitch_rate * yaw_rate
    a_z = axle * uphill + normal * level - along * pitch_acceleration - above * pitch_rate * pitch_rate
    lifted = a_z + gravity
    return a_x * cos(pitch) - lifted * sin(pitch), a_y, a_x * sin(pitch) + lifted * cos(pitch)


@kernel
def angular_rate(pitch: float, pitch_rate: float, yaw_rate: float) -> tuple[float, float]:
    """Return the body's angular rate about its y axis (left) and its z axis (up), in rad/s.

    omega_y = psi',   omega_z = phi' cos psi

    The yaw rate phi' turns about the vertical; the body's z axis leans by the pitch psi (rad), and the rest of phi'
    falls on the x axis. No term of psi' leaves the y axis, for the axle stays horizontal.
    """
    return pitch_rate, yaw_rate * cos(pitch)


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

/* Exact directional derivatives of the motion and of all outputs: plant.c and model.c, differentiated line by line. */
#include <math.h>
#include <string.h>

#include "coupling.h"
#include "linear.h"

/* ---- attitude ---------------------------------------------------------------------------------------------- */

/* The symmetric bilinear form B with R(e) = I + 2 B(e, e) / |e|^2. */
static void bilinear(const double a[4], const double b[4], double B[3][3])
{
    const double inner = a[1] * b[1] + a[2] * b[2] + a[3] * b[3];

    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            B[i][j] = 0.5 * (a[1 + i] * b[1 + j] + a[1 + j] * b[1 + i]) - (i == j ? inner : 0.0);
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        const double turn = 0.5 * (a[0] * b[1 + i] + a[1 + i] * b[0]);
        B[k][j] += turn;
        B[j][k] -= turn;
    }
}

static void rotation_tangent(const double e[4], const double de[4], double dR[3][3])
{
    const double square = e[0] * e[0] + dot3(e + 1, e + 1), inner = e[0] * de[0] + dot3(e + 1, de + 1);
    double B[3][3], dB[3][3];

    memset(dR, 0, 9 * sizeof(double));
    if (!(square > MIN_QUATERNION_NORM * MIN_QUATERNION_NORM))
        return;
    bilinear(e, e, B);
    bilinear(e, de, dB);
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            dR[i][j] = 4.0 / square * (dB[i][j] - inner / square * B[i][j]);
}

static void euler_tangent(const double R[3][3], const double dR[3][3], double deuler[3])
{
    const double square = R[2][1] * R[2][1] + R[2][2] * R[2][2], cosine = sqrt(square);
    const int upright = cosine > MIN_COS_PITCH;
    const double dcosine = upright ? (R[2][1] * dR[2][1] + R[2][2] * dR[2][2]) / cosine : 0.0;

    deuler[0] = upright ? (R[2][2] * dR[2][1] - R[2][1] * dR[2][2]) / square : 0.0;
    deuler[1] = R[2][0] * dcosine - cosine * dR[2][0];
    if (upright)
        deuler[2] = (R[0][0] * dR[1][0] - R[1][0] * dR[0][0]) / (R[0][0] * R[0][0] + R[1][0] * R[1][0]);
    else
        deuler[2] = (R[0][1] * dR[1][1] - R[1][1] * dR[0][1]) / (R[0][1] * R[0][1] + R[1][1] * R[1][1]);
}

/* ---- rigid body -------------------------------------------------------------------------------------------- */

/* Tangent of the momentum M_RB v: a = m (v + w x r_G), b = m r_G x v + I_b w. */
static void momentum_tangent(const Parameters *p, const Parameters *dp, const double nu[6], const double dnu[6],
                             double da[3], double db[3])
{
    const double *v = nu, *w = nu + 3, *dv = dnu, *dw = dnu + 3, *I = p->inertia, *dI = dp->inertia;
    double wr[3], dwr[3], wdr[3], rv[3], drv[3], rdv[3];

    cross(w, p->r_G, wr);
    cross(dw, p->r_G, dwr);
    cross(w, dp->r_G, wdr);
    cross(p->r_G, v, rv);
    cross(dp->r_G, v, drv);
    cross(p->r_G, dv, rdv);
    for (int i = 0; i < 3; i++) {
        da[i] = dp->mass * (v[i] + wr[i]) + p->mass * (dv[i] + dwr[i] + wdr[i]);
        db[i] = dp->mass * rv[i] + p->mass * (drv[i] + rdv[i]);
    }
    db[0] += dI[0] * w[0] + dI[3] * w[1] + dI[4] * w[2] + I[0] * dw[0] + I[3] * dw[1] + I[4] * dw[2];
    db[1] += dI[3] * w[0] + dI[1] * w[1] + dI[5] * w[2] + I[3] * dw[0] + I[1] * dw[1] + I[5] * dw[2];
    db[2] += dI[4] * w[0] + dI[5] * w[1] + dI[2] * w[2] + I[4] * dw[0] + I[5] * dw[1] + I[2] * dw[2];
}

/* Subtracts the tangent of a x b. */
static void subtract_cross(const double a[3], const double da[3], const double b[3], const double db[3], double out[3])
{
    double first[3], second[3];

    cross(da, b, first);
    cross(a, db, second);
    for (int i = 0; i < 3; i++)
        out[i] -= first[i] + second[i];
}

/* Tangent of subtract_coriolis in plant.c: p holds the momenta, linear and angular. */
static void subtract_coriolis_tangent(const double p[6], const double dp[6], const double nu[6], const double dnu[6],
                                      double dwrench[6])
{
    subtract_cross(nu + 3, dnu + 3, p, dp, dwrench);             /* w x a */
    subtract_cross(nu, dnu, p, dp, dwrench + 3);                 /* v x a */
    subtract_cross(nu + 3, dnu + 3, p + 3, dp + 3, dwrench + 3); /* w x b */
}

/* Tangent of the mass matrix: column by column, momentum_tangent of a constant motion. */
static void mass_matrix_tangent(const Parameters *p, const Parameters *dp, double dM[6][6])
{
    static const double zero[6] = {0.0};

    symmetric6(dp->added_mass, dM);
    for (int j = 0; j < 6; j++) {
        double unit[6] = {0.0}, column[6];
        unit[j] = 1.0;
        momentum_tangent(p, dp, unit, zero, column, column + 3);
        for (int i = 0; i < 6; i++)
            dM[i][j] += column[i];
    }
}

/* Tangent of add_external in plant.c. */
static void add_external_tangent(const External *x, const External *dx, const double R[3][3], const double dR[3][3],
                                 double dwrench[6])
{
    double force[3], dforce[3], moment[3], turned[3], first[3], second[3];

    to_body(R, x->force, force);
    to_body(dR, x->force, turned);
    to_body(R, dx->force, dforce);
    for (int i = 0; i < 3; i++)
        dforce[i] += turned[i];
    to_body(dR, x->moment, turned);
    to_body(R, dx->moment, moment);
    cross(dx->point, force, first);
    cross(x->point, dforce, second);
    for (int i = 0; i < 3; i++) {
        dwrench[i] += dforce[i] + dx->wrench[i];
        dwrench[3 + i] += turned[i] + moment[i] + first[i] + second[i] + dx->wrench[3 + i];
    }
}

/* Tangent of plant_derivative, whose result `rate` is given. */
static void derivative_tangent(const Model *m, const Model *seed, const double rate[N_RIGID], const double dtau[6],
                               double R[3][3], double dR[3][3], double dwater[3], double drate[N_RIGID])
{
    const Parameters *p = &m->plant.parameters, *dp = &seed->plant.parameters;
    const double *x = m->state.rigid, *e = x + 3, *nu = x + 7, *omega = x + 10;
    const double *dx = seed->state.rigid, *de = dx + 3, *dnu = dx + 7, *domega = dx + 10;
    const Drift *drift = &m->held.drift;
    const double zero[6] = {0.0};
    double first[4], second[4], dwrench[6], dadded_mass[6][6];

    plant_rotation(e, R);
    rotation_tangent(e, de, dR);
    for (int i = 0; i < 3; i++)
        drate[i] = dot3(dR[i], nu) + dot3(R[i], dnu);
    quaternion_rate(de, omega, first);
    quaternion_rate(e, domega, second);
    for (int i = 0; i < 4; i++)
        drate[3 + i] = first[i] + second[i];

    /* velocity relative to the water */
    const double below = fmax(x[2], 0.0), is_below = x[2] > 0.0 ? 1.0 : 0.0;
    double water[3], current[3], dcurrent[3], nu_r[6], dnu_r[6], nu_c_rate[6] = {0.0}, dnu_c_rate[6] = {0.0};
    environment_current(p, drift, m->time, x[2], water);
    for (int i = 0; i < 3; i++)
        dwater[i] = dp->current[i] + dp->current_shear[i] * below + p->current_shear[i] * is_below * dx[2] +
                    drift->slope[i] * seed->time;
    for (int i = 0; i < 3; i++) {
        current[i] = dcurrent[i] = 0.0;
        for (int j = 0; j < 3; j++) {
            const double water_rate =
                drift->slope[j] + p->current_shear[j] * is_below * rate[2] + m->plant.external.current_rate[j];
            const double dwater_rate = is_below * (dp->current_shear[j] * rate[2] + p->current_shear[j] * drate[2]) +
                                       seed->plant.external.current_rate[j];
            current[i] += R[j][i] * water[j];
            dcurrent[i] += dR[j][i] * water[j] + R[j][i] * dwater[j];
            nu_c_rate[i] += R[j][i] * water_rate;
            dnu_c_rate[i] += dR[j][i] * water_rate + R[j][i] * dwater_rate;
        }
    }
    cross(omega, current, first);
    for (int i = 0; i < 3; i++)
        nu_c_rate[i] -= first[i];
    cross(domega, current, first);
    cross(omega, dcurrent, second);
    for (int i = 0; i < 6; i++) {
        nu_r[i] = nu[i] - (i < 3 ? current[i] : 0.0);
        dnu_r[i] = dnu[i] - (i < 3 ? dcurrent[i] : 0.0);
        dnu_c_rate[i] -= i < 3 ? first[i] + second[i] : 0.0;
    }

    for (int i = 0; i < 6; i++)
        dwrench[i] = dtau[i] + dp->trim[i];

    /* momenta of the body and of the water; M_RB nu itself is linear in nu, so its own tangent gives it */
    double a[6], da[6], added[6], dadded[6], term[6];
    const Parameters nothing = {0};
    momentum_tangent(p, &nothing, zero, nu, a, a + 3);
    momentum_tangent(p, dp, nu, dnu, da, da + 3);
    subtract_coriolis_tangent(a, da, nu, dnu, dwrench);

    symmetric6(dp->added_mass, dadded_mass);
    multiply6(m->plant.derived.added_mass, nu_r, added);
    multiply6(m->plant.derived.added_mass, dnu_r, dadded);
    multiply6((const double(*)[6])dadded_mass, nu_r, term);
    for (int i = 0; i < 6; i++)
        dadded[i] += term[i];
    subtract_coriolis_tangent(added, dadded, nu_r, dnu_r, dwrench);

    multiply6(m->plant.derived.added_mass, dnu_c_rate, term);
    for (int i = 0; i < 6; i++)
        dwrench[i] += term[i];
    multiply6((const double(*)[6])dadded_mass, nu_c_rate, term);
    for (int i = 0; i < 6; i++)
        dwrench[i] += term[i] - (dp->linear_damping[i] + dp->quadratic_damping[i] * fabs(nu_r[i])) * nu_r[i] -
                      (p->linear_damping[i] + 2.0 * p->quadratic_damping[i] * fabs(nu_r[i])) * dnu_r[i];

    /* restoring */
    const double depth_B = x[2] + dot3(R[2], p->r_B);
    const double ddepth_B = dx[2] + dot3(dR[2], p->r_B) + dot3(R[2], dp->r_B);
    const double submerged = environment_submerged(p, depth_B), buoyancy = p->buoyancy * submerged;
    const double dbuoyancy =
        dp->buoyancy * submerged + p->buoyancy * environment_submerged_tangent(p, dp, depth_B, ddepth_B);
    double lever[3], dlever[3];
    for (int i = 0; i < 3; i++) {
        lever[i] = p->r_G[i] * p->weight - p->r_B[i] * buoyancy;
        dlever[i] = dp->r_G[i] * p->weight + p->r_G[i] * dp->weight - dp->r_B[i] * buoyancy - p->r_B[i] * dbuoyancy;
    }
    cross(dlever, R[2], first);
    cross(lever, dR[2], second);
    for (int i = 0; i < 3; i++) {
        dwrench[i] += (dp->weight - dbuoyancy) * R[2][i] + (p->weight - buoyancy) * dR[2][i];
        dwrench[3 + i] += first[i] + second[i];
    }

    const double penetration = environment_penetration(p, x[2]);
    if (penetration > 0.0) {
        double contact[3], dcontact[3], dM[6][6];
        environment_contact(&m->plant, penetration, rate, contact);
        mass_matrix_tangent(p, dp, dM);
        environment_contact_tangent(&m->plant, dp, (const double(*)[6])dM, x[2], dx[2], rate, drate, dcontact);
        for (int i = 0; i < 3; i++)
            for (int j = 0; j < 3; j++)
                dwrench[i] += dR[j][i] * contact[j] + R[j][i] * dcontact[j];
    }

    if (m->plant.external.active)
        add_external_tangent(&m->plant.external, &seed->plant.external, (const double(*)[3])R, (const double(*)[3])dR,
                             dwrench);

    /* M nu' = wrench */
    momentum_tangent(p, dp, rate + 7, zero, da, da + 3);
    multiply6((const double(*)[6])dadded_mass, rate + 7, term);
    for (int i = 0; i < 6; i++)
        dwrench[i] -= da[i] + term[i];
    multiply6(m->plant.derived.mass_inverse, dwrench, drate + 7);
}

/* ---- all outputs ------------------------------------------------------------------------------------------- */

static void measured_tangent(const Model *m, const Model *seed, int starting, const double R[3][3],
                             const double dR[3][3], const Outputs *d, double dmeasured[N_MEASURED])
{
    const Parameters *p = &m->plant.parameters, *dp = &seed->plant.parameters;
    const double *nu = m->state.rigid + 7, *omega = m->state.rigid + 10;
    const double *dx = seed->state.rigid, *dnu = dx + 7, *domega = dx + 10;
    double first[3], second[3], lever_velocity[3], by_omega[3], by_lever[3];

    cross(domega, nu, first);
    cross(omega, dnu, second);
    cross(omega, p->r_DVL, lever_velocity);
    cross(domega, p->r_DVL, by_omega);
    cross(omega, dp->r_DVL, by_lever);
    dmeasured[MEASURED_DEPTH] = dx[2];
    dmeasured[MEASURED_ALTITUDE] = d->altitude;
    dmeasured[MEASURED_HEADING] = d->euler[2];
    for (int i = 0; i < 3; i++) {
        dmeasured[MEASURED_VELOCITY + i] = (1.0 + p->velocity_scale_error) * (dnu[i] + by_omega[i] + by_lever[i]) +
                                           dp->velocity_scale_error * (nu[i] + lever_velocity[i]);
        dmeasured[MEASURED_ACCELERATION + i] =
            d->rate.rigid[7 + i] + first[i] + second[i] - dp->gravity * R[2][i] - p->gravity * dR[2][i];
        dmeasured[MEASURED_ANGULAR_VELOCITY + i] = domega[i];
        dmeasured[MEASURED_POSITION + i] = dx[i];
    }
    for (int i = 0; i < N_MEASURED; i++) {
        dmeasured[i] = !starting && model_shows_sample(m, i) ? 0.0 : dmeasured[i] + dp->bias[i];
    }
}

static void tangent_core(const Model *m, const Model *seed, int starting, Model *tangent)
{
    const Parameters *p = &m->plant.parameters, *dp = &seed->plant.parameters;
    Outputs *d = &tangent->outputs;
    Actuators dforce;
    double dtau[6], R[3][3], dR[3][3];

    tangent->state = seed->state;
    actuators_tangent(p, dp, &m->inputs, &seed->inputs, &m->state.actuators, &seed->state.actuators,
                      &d->rate.actuators, &dforce, dtau);
    memcpy(d->thrust, dforce.thrust, sizeof d->thrust);
    memcpy(d->wrench, dtau, sizeof d->wrench);
    derivative_tangent(m, seed, m->outputs.rate.rigid, dtau, R, dR, d->water, d->rate.rigid);
    euler_tangent((const double(*)[3])R, (const double(*)[3])dR, d->euler);
    d->altitude = dp->bottom_depth - seed->state.rigid[2];
    measured_tangent(m, seed, starting, (const double(*)[3])R, (const double(*)[3])dR, d, d->measured);
    for (int i = 0; i < N_SENSORS; i++)
        d->stamp[i] = m->held.clocks[i].period > 0.0 && !(starting && m->held.delivered[i] > 0.0) ? 0.0 : seed->time;
}

void model_tangent(const Model *m, const Model *seed, int starting, Model *tangent)
{
    Model coupled, direction;

    if (!COUPLED) {
        tangent_core(m, seed, starting, tangent);
        return;
    }
    coupling_apply(m, &coupled); /* inputs that are off have derivatives too */
    coupling_tangent(m, seed, &direction);
    tangent_core(&coupled, &direction, starting, tangent);
}

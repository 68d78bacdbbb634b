#include "lights/analytic.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <string>

#include "engine/base/sampler.h"
#include "engine/base/vec.h"
#include "engine/base/warp.h"
#include "tests/support/statistics.h"

namespace lucerna {
namespace analytic_test {

using testing::agrees;
using testing::chi_square;

V3f random_direction(Sampler& s) {
    return square_to_sphere(s.next2()).normalized();
}
LeSampleU le_u(Sampler& s) {
    return {s.next2(), s.next2(), s.bits()};
}

// A ray's intersection with an emitter, in double precision: the distance and the normal of the emitting
// side.
struct ShapeHit {
    double t;
    V3d n;
};
using Intersect = std::function<std::optional<ShapeHit>(const Ray&)>;

Intersect intersect_triangles(const TriangleEmitter& e) {
    return [e](const Ray& ray) {
        std::optional<ShapeHit> nearest;
        for (const V3i& triangle : e.triangles) {
            const V3d p0(e.p[static_cast<std::size_t>(triangle.x)]);
            const V3d e1 = V3d(e.p[static_cast<std::size_t>(triangle.y)]) - p0;
            const V3d e2 = V3d(e.p[static_cast<std::size_t>(triangle.z)]) - p0;
            const V3d n = e1.cross(e2), d(ray.d), o = V3d(ray.o) - p0;
            const double det = -d.dot(n), t = o.dot(n) / det;
            const double b1 = -d.dot(o.cross(e2)) / det, b2 = -d.dot(e1.cross(o)) / det;
            if (!(t > 0 && b1 >= 0 && b2 >= 0 && b1 + b2 <= 1)) continue;
            if (!nearest || t < nearest->t) nearest = ShapeHit{t, (e.reverse ? -n : n).normalized()};
        }
        return nearest;
    };
}

Intersect intersect_disk(const DiskEmitter& e) {
    return [e](const Ray& ray) -> std::optional<ShapeHit> {
        const V3d n(e.n), o = V3d(ray.o) - V3d(e.centre), d(ray.d);
        const double t = -o.dot(n) / d.dot(n);
        const double r = (o + t * d).length();
        if (!(t > 0) || r > static_cast<double>(e.radius) || r < static_cast<double>(e.inner_radius))
            return {};
        return ShapeHit{t, n};
    };
}

Intersect intersect_sphere(const SphereEmitter& e) {
    return [e](const Ray& ray) -> std::optional<ShapeHit> {
        const V3d o = V3d(ray.o) - V3d(e.centre), d(ray.d);
        const double b = o.dot(d),
                     disc = b * b - d.length2() * (o.length2() - sqr(static_cast<double>(e.radius)));
        if (disc < 0) return {};
        for (const double t : {(-b - std::sqrt(disc)) / d.length2(), (-b + std::sqrt(disc)) / d.length2()}) {
            const V3d n = (o + t * d).normalized();
            if (t > 1e-9) return ShapeHit{t, e.reverse ? -n : n};
        }
        return {};
    };
}

// Returns two triangles of different size and orientation, like a bent sheet; both face the origin.
TriangleEmitter bent_sheet() {
    return {{{-1, -1, 2}, {1, -1, 2}, {1, 1, 2.5F}, {-1, 1.5F, 2.2F}}, {{0, 2, 1}, {0, 3, 2}}, false};
}

struct Lamp {
    std::string name;
    std::unique_ptr<Light> light;
    Intersect intersect;  // empty if it is not an area light. The origin sees all of it, so its density
                          // integrates to 1
};

std::vector<Lamp> all_lamps() {
    const Rgb colour(2, 1, 0.5F);
    const SceneSphere scene{{0.2F, 0, 0.1F}, 4};
    const SphereEmitter ball{{0.5F, 0.4F, 2}, 0.8F}, room{{0.1F, 0, 0.2F}, 3, true};
    const DiskEmitter disk{{0.3F, 0.2F, 2}, V3f(0.2F, 0.1F, -1).normalized(), 0.9F},
        ring{{0.3F, 0.2F, 2}, V3f(0.2F, 0.1F, 1).normalized(), 0.9F, 0.5F};
    std::vector<Lamp> lamps;
    lamps.push_back({"point", make_point_light({0.3F, 0.2F, 1.5F}, colour), {}});
    lamps.push_back({"spot", make_spot_light({0.3F, 0.2F, 1.5F}, {-0.1F, 0, -2}, colour, {40, 25}), {}});
    lamps.push_back({"distant", make_distant_light({0.3F, 0.2F, -1}, colour, scene), {}});
    lamps.push_back({"infinite", make_infinite_light(colour, scene), {}});
    lamps.push_back({"sun", make_sun_light({-0.3F, -0.2F, 1}, 0.1, colour, scene), {}});
    lamps.push_back(
        {"triangles", make_area_light(bent_sheet(), colour, false), intersect_triangles(bent_sheet())});
    lamps.push_back({"ball", make_area_light(ball, colour, false), intersect_sphere(ball)});
    lamps.push_back({"ball, two-sided", make_area_light(ball, colour, true), intersect_sphere(ball)});
    lamps.push_back({"room", make_area_light(room, colour, false), intersect_sphere(room)});
    lamps.push_back({"disk", make_area_light(disk, colour, false), intersect_disk(disk)});
    lamps.push_back({"ring, two-sided", make_area_light(ring, colour, true), intersect_disk(ring)});
    return lamps;
}

TEST(AnalyticLight, Emission_WeighsTheFluxInTheMean) {
    for (const Lamp& lamp : all_lamps()) {
        Sampler s(1, Purpose::test, 0, 0);
        RunningStats stats;
        for (int i = 0; i < 10000; ++i) {
            const auto emitted = lamp.light->sample_Le(le_u(s));
            ASSERT_TRUE(emitted) << lamp.name;
            stats.add(static_cast<double>(luminance(emitted->weight)));
            EXPECT_NEAR(emitted->d.length(), 1, 1e-5F) << lamp.name;
        }
        EXPECT_NEAR(stats.mean(), lamp.light->power(),
                    4 * stats.standard_error() + 1e-6 * lamp.light->power())
            << lamp.name;
    }
}

// The flux through a disc of radius 0.4 about the origin that faces +z, estimated from particles and by
// sample_Li().
struct PatchFlux {
    RunningStats by_particles, by_sample_Li;
    double gap() const { return by_particles.mean() - by_sample_Li.mean(); }
    double sigma() const { return std::hypot(by_particles.standard_error(), by_sample_Li.standard_error()); }
};

PatchFlux patch_flux(const Lamp& lamp, int samples) {
    constexpr float kRadius = 0.4F;
    PatchFlux result;
    Sampler s(2, Purpose::test, 0, 0);
    for (int i = 0; i < samples; ++i) {
        const auto emitted = lamp.light->sample_Le(le_u(s));
        double power = 0;
        if (emitted && emitted->d.z < 0 && emitted->from.p.z > 0) {
            const double way = static_cast<double>(-emitted->from.p.z / emitted->d.z);
            const V3f at = emitted->from.p + static_cast<float>(way) * emitted->d;
            // Light that hits the lamp itself does not arrive.
            const Ray ray{emitted->from.towards(emitted->d), emitted->d};
            const auto stopped = lamp.intersect ? lamp.intersect(ray) : std::nullopt;
            const bool arrives = V2f(at.x, at.y).length() < kRadius && !(stopped && stopped->t < way);
            if (arrives) power = static_cast<double>(luminance(emitted->weight));
        }
        result.by_particles.add(power);

        const V2f place = kRadius * square_to_disc(s.next2());
        const auto light_sample = lamp.light->sample_Li({place.x, place.y, 0}, s.next2());
        const float cosine = light_sample ? std::max(0.0F, light_sample->w.z) : 0.0F;
        result.by_sample_Li.add(light_sample
                                    ? static_cast<double>(luminance(light_sample->weight) * cosine * kPi) *
                                          sqr(static_cast<double>(kRadius))
                                    : 0.0);
    }
    return result;
}

TEST(AnalyticLight, ParticlesOnAPatch_CarryWhatSampleLiPromises) {
    for (const Lamp& lamp : all_lamps()) {
        // Only few of the particles that are emitted in all directions meet the patch.
        const bool everywhere =
            lamp.name == "infinite" || lamp.name == "room" || lamp.name == "ball, two-sided";
        const PatchFlux flux = patch_flux(lamp, everywhere ? 1500000 : 300000);
        EXPECT_GT(flux.by_sample_Li.mean(), 0) << lamp.name;
        EXPECT_LT(flux.sigma(), 0.02 * flux.by_sample_Li.mean())
            << lamp.name << ": too noisy to say anything";
        EXPECT_LT(std::fabs(flux.gap()), 4 * flux.sigma()) << lamp.name << " " << flux.by_sample_Li.mean();
        // The same test rejects a light whose power is wrong by a tenth.
        EXPECT_GT(std::fabs(flux.gap() + 0.1 * flux.by_sample_Li.mean()), 4 * flux.sigma()) << lamp.name;
    }
}

TEST(AreaLight, LeOnSurface_KnowsTheDensityThatSampleLiUsed) {
    for (const Lamp& lamp : all_lamps()) {
        if (!lamp.intersect) continue;
        Sampler s(3, Purpose::test, 0, 0);
        int compared = 0;
        for (int i = 0; i < 20000; ++i) {
            const V3f x = 0.8F * s.next() * random_direction(s);
            const auto light_sample = lamp.light->sample_Li(x, s.next2());
            if (!light_sample) continue;
            const Ray ray{x, light_sample->w};
            const auto hit = lamp.intersect(ray);
            // In float32, directions that graze the emitter may miss it.
            if (!hit || std::fabs(hit->n.dot(V3d(ray.d))) < 0.02) continue;
            const EmittedRadiance seen =
                lamp.light->Le_on_surface(ray, static_cast<float>(hit->t), V3f(hit->n), 0);
            EXPECT_NEAR(seen.pdf_w / light_sample->pdf_w, 1, 1e-3F) << lamp.name;
            const Rgb radiance = light_sample->weight * light_sample->pdf_w;
            EXPECT_LT(std::fabs(luminance(radiance - seen.radiance)), 1e-4F) << lamp.name;
            // The sample's distance ends just short of the emitter.
            EXPECT_LT(static_cast<double>(light_sample->distance), hit->t) << lamp.name;
            EXPECT_GT(static_cast<double>(light_sample->distance), hit->t * (1 - 1e-3)) << lamp.name;
            ++compared;
        }
        EXPECT_GT(compared, 15000) << lamp.name;
    }
}

TEST(AreaLight, DensityOverAllDirections_IntegratesToOne) {
    for (const Lamp& lamp : all_lamps()) {
        if (!lamp.intersect) continue;
        Sampler s(4, Purpose::test, 0, 0);
        RunningStats density, by_Le, by_sample_Li;
        for (int i = 0; i < 400000; ++i) {
            const Ray ray{{0, 0, 0}, random_direction(s)};
            EmittedRadiance seen{Rgb(0), 0, 0};
            if (const auto hit = lamp.intersect(ray)) {
                seen = lamp.light->Le_on_surface(ray, static_cast<float>(hit->t), V3f(hit->n), 0);
            }
            density.add(4 * kPiD * static_cast<double>(seen.pdf_w));
            by_Le.add(4 * kPiD * static_cast<double>(luminance(seen.radiance) * std::fabs(ray.d.z)));
            const auto light_sample = lamp.light->sample_Li({0, 0, 0}, s.next2());
            by_sample_Li.add(light_sample ? static_cast<double>(luminance(light_sample->weight) *
                                                                std::fabs(light_sample->w.z))
                                          : 0);
        }
        EXPECT_TRUE(agrees(density, 1)) << lamp.name << " " << density.mean();
        EXPECT_FALSE(agrees(density, 1.1)) << lamp.name;
        const double sigma = std::hypot(by_Le.standard_error(), by_sample_Li.standard_error());
        EXPECT_LT(std::fabs(by_Le.mean() - by_sample_Li.mean()), 4 * sigma) << lamp.name;
    }
}

// Estimates the irradiance at x on a plane with normal n, in W/m².
RunningStats irradiance(const Light& light, const V3f& x, const V3f& n, int samples = 100000) {
    RunningStats stats;
    Sampler s(5, Purpose::test, 0, 0);
    for (int i = 0; i < samples; ++i) {
        const auto light_sample = light.sample_Li(x, s.next2());
        stats.add(light_sample
                      ? static_cast<double>(light_sample->weight.x * std::max(0.0F, n.dot(light_sample->w)))
                      : 0.0);
    }
    return stats;
}

// Expects agreement within 4 sigma, or within the rounding of float32 where all samples have equal weights.
void expect_irradiance(const RunningStats& stats, double truth, const std::string& what) {
    EXPECT_NEAR(stats.mean(), truth, 4 * stats.standard_error() + 1e-5 * truth) << what;
    EXPECT_LT(stats.standard_error(), 0.01 * truth) << what;
}

TEST(AreaLight, DiskOnItsAxis_EqualsClosedForm) {
    for (const double h : {0.3, 1.0, 10.0}) {
        const auto light =
            make_area_light(DiskEmitter{{0, 0, static_cast<float>(h)}, {0, 0, -1}, 1}, Rgb(3), false);
        expect_irradiance(irradiance(*light, {0, 0, 0}, {0, 0, 1}), kPiD * 3 / (1 + h * h),
                          std::to_string(h));
        EXPECT_FALSE(light->sample_Li({0, 0, static_cast<float>(2 * h)}, {0.5F, 0.5F})) << "its back is dark";
    }
}

TEST(AreaLight, SphereFromOutside_EqualsClosedForm) {
    // The sphere is fully above the horizon, at up to a million radii: E = π L (r/d)² cos θ.
    for (const float d : {1.001F, 1.5F, 10.0F, 1e3F, 1e6F}) {
        for (const float r : {1e-3F, 1.0F, 1e3F}) {
            const auto light = make_area_light(SphereEmitter{{0, 0, d * r}, r}, Rgb(3), false);
            const double dr = static_cast<double>(d * r) / static_cast<double>(r);
            expect_irradiance(irradiance(*light, {0, 0, 0}, {0, 0, 1}), kPiD * 3 / (dr * dr),
                              std::to_string(d) + " " + std::to_string(r));
        }
    }
}

TEST(AreaLight, RoomOfLight_GivesPiLAnywhereInsideAndOnItsWall) {
    const auto room = make_area_light(SphereEmitter{{0.3F, 0, 0}, 2, true}, Rgb(3), false);
    Sampler s(6, Purpose::test, 0, 0);
    for (int i = 0; i < 10; ++i) {
        const V3f inside = V3f(0.3F, 0, 0) + 1.5F * s.next() * random_direction(s);
        expect_irradiance(irradiance(*room, inside, random_direction(s)), kPiD * 3, "inside");
        const V3f n = random_direction(s);
        expect_irradiance(irradiance(*room, V3f(0.3F, 0, 0) - 2.0F * n, n), kPiD * 3, "on the wall");
    }
    EXPECT_FALSE(room->sample_Li({5, 0, 0}, {0.5F, 0.5F})) << "its outside is dark";
}

TEST(AreaLight, RectangleAnywhere_EqualsLambertsContourFormula) {
    const TriangleEmitter e{
        {{-1, 0, 2}, {1.5F, 0, 2}, {1.5F, 1, 2.5F}, {-1, 1, 2.5F}}, {{0, 2, 1}, {0, 3, 2}}, false};
    const auto light = make_area_light(e, Rgb(3), false);
    for (const V3f& x : {V3f(0, 0, 0), V3f(2, 0.5F, 0.5F), V3f(0, 0.5F, 1.9F)}) {
        V3d sum(0, 0, 0);
        for (int i = 0; i < 4; ++i) {
            const V3d a = (V3d(e.p[static_cast<std::size_t>(i)]) - V3d(x)).normalized();
            const V3d b = (V3d(e.p[static_cast<std::size_t>((i + 1) % 4)]) - V3d(x)).normalized();
            sum += std::acos(a.dot(b)) * a.cross(b).normalized();
        }
        // Seen from below, the order of the corners is counter-clockwise about -z, hence the sign.
        const double truth = std::fabs(3 * 0.5 * sum.z);
        expect_irradiance(irradiance(*light, x, {0, 0, 1}, 400000), truth, "rectangle");
    }
}

// A tilted plane receives E times the cosine at the middle of a disc that is all above its horizon.
TEST(SunLight, Irradiance_IsThatOfItsMiddle) {
    const double radius = 0.00465;
    const V3f towards = V3f(0, 3, 4).normalized();
    const auto sun = make_sun_light(towards, radius, Rgb(5), {});
    expect_irradiance(irradiance(*sun, {7, 8, 9}, {0, 0, 1}), 4.0, "sun");
    const double seen = kPiD * sqr(std::sin(radius));
    const auto middle = sun->Le(Ray{{7, 8, 9}, towards});
    ASSERT_TRUE(middle);
    EXPECT_NEAR(double{middle->radiance.x}, 5 / seen, 1e-4 * 5 / seen);
    const auto beside = [&](double angle) {
        const Frame frame(towards);
        const auto a = static_cast<float>(angle);
        return sun->Le(Ray{{0, 0, 0}, frame.to_world({std::sin(a), 0, std::cos(a)})});
    };
    EXPECT_TRUE(beside(0.99 * radius));
    EXPECT_FALSE(beside(1.01 * radius));
}

TEST(SunLight, SampleLi_AndLe_AgreeInDensityAndRadiance) {
    const auto sun = make_sun_light({0.1F, 0.2F, 0.9F}, 0.2, Rgb(5), {});
    Sampler s(8, Purpose::test, 0, 0);
    RunningStats density;
    for (int i = 0; i < 20000; ++i) {
        const auto drawn = sun->sample_Li({0, 0, 0}, s.next2());
        ASSERT_TRUE(drawn);
        if (const auto seen = sun->Le(Ray{{0, 0, 0}, drawn->w})) {
            EXPECT_FLOAT_EQ(seen->pdf_w, drawn->pdf_w);
            EXPECT_NEAR(seen->radiance.x, drawn->weight.x * drawn->pdf_w, 1e-5F * seen->radiance.x);
        }
        const auto seen = sun->Le(Ray{{0, 0, 0}, random_direction(s)});
        density.add(seen ? 4 * kPiD * double{seen->pdf_w} : 0.0);
    }
    EXPECT_TRUE(agrees(density, 1)) << density.mean();
    EXPECT_FALSE(agrees(density, 1.3));
}

TEST(AnalyticLight, PointSpotDistantInfinite_GiveTheirClosedIrradiance) {
    const V3f up(0, 0, 1);
    expect_irradiance(irradiance(*make_point_light({3, 0, 4}, Rgb(5)), {0, 0, 0}, up, 10), 5.0 / 25 * 0.8,
                      "point");
    const auto spot = make_spot_light({0, 0, 2}, {0, 0, -1}, Rgb(5), {30, 5});
    expect_irradiance(irradiance(*spot, {0, 0, 0}, up, 10), 5.0 / 4, "spot");
    expect_irradiance(irradiance(*make_distant_light({0, -3, -4}, Rgb(5), {}), {7, 8, 9}, up, 10), 4.0,
                      "distant");
    expect_irradiance(irradiance(*make_infinite_light(Rgb(5), {}), {7, 8, 9}, up), kPiD * 5, "infinite");
}

double smooth_fall(double c, double cone_degrees, double delta_degrees) {
    const double total = std::cos(cone_degrees * kPiD / 180),
                 start = std::cos((cone_degrees - delta_degrees) * kPiD / 180);
    const double t = std::clamp((c - total) / (start - total), 0.0, 1.0);
    return 3 * t * t - 2 * t * t * t;
}

TEST(SpotLight, Flux_EqualsQuadratureOfItsFalloff) {
    for (const auto& [cone, delta] : {std::pair{30.0F, 5.0F}, {30, 30}, {90, 10}, {170, 60}, {2, 1}}) {
        const auto light = make_spot_light({0, 0, 0}, {0, 0, 1}, Rgb(1), {cone, delta});
        // Integrates over the cosine by the midpoint rule, within the cone only.
        const double low = std::cos(static_cast<double>(cone) * kPiD / 180);
        constexpr int kSteps = 200000;
        double sum = 0;
        for (int i = 0; i < kSteps; ++i) {
            sum += smooth_fall(low + (1 - low) * (i + 0.5) / kSteps, static_cast<double>(cone),
                               static_cast<double>(delta));
        }
        EXPECT_NEAR(static_cast<double>(light->flux().x) / (2 * kPiD * (1 - low) * sum / kSteps), 1, 1e-5)
            << cone;
    }
}

// The falloff of glTF is the square of a linear function of the cosine.
TEST(SpotLight, QuadraticFalloff_IsIntensityFluxAndDirections) {
    constexpr double kCone = 60, kDelta = 35;
    const auto light = make_spot_light({0, 0, 0}, {0, 0, 1}, Rgb(1), {kCone, kDelta, SpotFalloff::quadratic});
    const double low = std::cos(kCone * kPiD / 180), full = std::cos((kCone - kDelta) * kPiD / 180);
    EXPECT_NEAR(static_cast<double>(light->flux().x), 2 * kPiD * ((1 - full) + (full - low) / 3), 1e-5);
    std::vector<std::uint64_t> counts(40);
    std::vector<double> expected(40), pbrts(40);
    Sampler s(8, Purpose::test, 0, 0);
    constexpr int kSamples = 100000;
    for (int i = 0; i < kSamples; ++i) {
        const double place = (static_cast<double>(light->sample_Le(le_u(s))->d.z) - low) / (1 - low);
        ++counts[static_cast<std::size_t>(std::clamp(place * 40, 0.0, 39.0))];
    }
    double sum = 0, sum_of_pbrts = 0;
    for (int i = 0; i < 40000; ++i) {
        const double c = low + (1 - low) * (i + 0.5) / 40000,
                     t = std::clamp((c - low) / (full - low), 0.0, 1.0);
        const auto bin = static_cast<std::size_t>(i / 1000);
        expected[bin] += t * t, sum += t * t;
        pbrts[bin] += smooth_fall(c, kCone, kDelta), sum_of_pbrts += smooth_fall(c, kCone, kDelta);
        if (i % 4000 != 0) continue;
        const auto sine = static_cast<float>(std::sqrt(1 - c * c));
        const auto seen = light->sample_Li({sine, 0, static_cast<float>(c)}, {}, {});
        EXPECT_NEAR(seen ? static_cast<double>(seen->weight.x) : 0.0, t * t, 1e-5) << c;
    }
    for (double& e : expected) e *= kSamples / sum;
    for (double& e : pbrts) e *= kSamples / sum_of_pbrts;
    EXPECT_TRUE(chi_square(counts, expected).accepted());
    EXPECT_FALSE(chi_square(counts, pbrts).accepted());
}

TEST(SpotLight, Directions_FollowTheFalloff) {
    const auto light = make_spot_light({1, 2, 3}, {1, 1, 1}, Rgb(1), {60, 35});
    const V3f axis = V3f(1, 1, 1).normalized();
    constexpr int kBins = 40, kSamples = 200000;
    std::vector<std::uint64_t> counts(kBins);
    std::vector<double> expected(kBins), uniform(kBins, kSamples / static_cast<double>(kBins));
    Sampler s(7, Purpose::test, 0, 0);
    for (int i = 0; i < kSamples; ++i) {
        const auto emitted = light->sample_Le(le_u(s));
        ASSERT_TRUE(emitted);
        const double place = (static_cast<double>(emitted->d.dot(axis)) - 0.5) / 0.5;
        ASSERT_GT(place, -1e-5);
        ++counts[static_cast<std::size_t>(std::clamp(place * kBins, 0.0, kBins - 1.0))];
    }
    double sum = 0;
    for (int i = 0; i < kBins * 1000; ++i) {
        const double f = smooth_fall(0.5 + 0.5 * (i + 0.5) / (kBins * 1000), 60, 35);
        expected[static_cast<std::size_t>(i / 1000)] += f;
        sum += f;
    }
    for (double& e : expected) e *= kSamples / sum;
    EXPECT_TRUE(chi_square(counts, expected).accepted());
    EXPECT_FALSE(chi_square(counts, uniform).accepted());
}

TEST(SpotLight, EdgeCases_AreFullOrDarkButNeverNaN) {
    const auto sharp = make_spot_light({0, 0, 0}, {0, 0, 1}, Rgb(1), {30, 0});
    EXPECT_EQ(sharp->sample_Li({0, std::tan(29 * kPi / 180), 1}, {})->weight.x > 0, true);
    EXPECT_FALSE(sharp->sample_Li({0, std::tan(31 * kPi / 180), 1}, {}));
    EXPECT_FALSE(sharp->sample_Li({0, 0, -1}, {}));
    EXPECT_FALSE(sharp->sample_Li({0, 0, 0}, {}));
    const auto none = make_spot_light({0, 0, 0}, {0, 0, 1}, Rgb(1), {0, 0});
    EXPECT_EQ(none->power(), 0);
    EXPECT_FALSE(none->sample_Le({}));
    for (const float u : {0.0F, 0.25F, 0.5F, 0x1.fffffep-1F}) {
        for (const auto& [cone, delta] : {std::pair{30.0F, 0.0F}, {30, 30}, {0.001F, 0.0005F}, {180, 180}}) {
            const auto emitted =
                make_spot_light({0, 0, 0}, {0, 0, 1}, Rgb(1), {cone, delta})->sample_Le({{u, u}, {u, u}});
            ASSERT_TRUE(emitted);
            EXPECT_NEAR(emitted->d.length(), 1, 1e-5F);
            EXPECT_GE(emitted->d.z, std::cos(cone * kPi / 180) - 1e-5F);
        }
    }
}

TEST(AreaLight, Emission_IsUniformInAreaAndLambertian) {
    const auto sheet = bent_sheet();
    for (const bool two_sided : {false, true}) {
        const auto light = make_area_light(sheet, Rgb(1), two_sided);
        constexpr int kSamples = 200000, kBins = 10;
        std::array<double, 2> areas{};
        std::vector<std::uint64_t> piece(2 * 4), lambert(2 * kBins);
        for (std::size_t i = 0; i < 2; ++i) {
            const V3i t = sheet.triangles[i];
            const auto at = [&](int c) { return sheet.p[static_cast<std::size_t>(t[c])]; };
            areas[i] = static_cast<double>((at(1) - at(0)).cross(at(2) - at(0)).length()) / 2;
        }
        const Intersect intersect = intersect_triangles(sheet);
        Sampler s(8, Purpose::test, 0, 0);
        for (int i = 0; i < kSamples; ++i) {
            const auto e = light->sample_Le(le_u(s));
            ASSERT_TRUE(e);
            // Finds the triangle, and its quarter (the middle one, or that of a corner).
            const std::size_t which =
                (e->from.n - (sheet.p[2] - sheet.p[0]).cross(sheet.p[1] - sheet.p[0]).normalized()).length() <
                        1e-4F
                    ? 0
                    : 1;
            const V3i t = sheet.triangles[which];
            const V3d p0(sheet.p[static_cast<std::size_t>(t.x)]);
            const V3d e1 = V3d(sheet.p[static_cast<std::size_t>(t.y)]) - p0,
                      e2 = V3d(sheet.p[static_cast<std::size_t>(t.z)]) - p0;
            const V3d q = V3d(e->from.p) - p0, n = e1.cross(e2);
            EXPECT_NEAR(q.dot(n), 0, 1e-5);
            const double b1 = q.cross(e2).dot(n) / n.length2(), b2 = e1.cross(q).dot(n) / n.length2();
            const std::size_t quarter = b1 > 0.5 ? 1 : b2 > 0.5 ? 2 : b1 + b2 < 0.5 ? 3 : 0;
            ++piece[4 * which + quarter];
            const float cosine = e->from.n.dot(e->d);
            const auto bin =
                std::min(kBins - 1, static_cast<int>(cosine * cosine * kBins));  // cos² is uniform
            ++lambert[static_cast<std::size_t>(bin + (cosine < 0 ? kBins : 0))];
        }
        std::vector<double> expected(8), expected_lambert(2 * kBins);
        for (std::size_t i = 0; i < 8; ++i) expected[i] = kSamples * areas[i / 4] / (areas[0] + areas[1]) / 4;
        for (std::size_t i = 0; i < 2 * kBins; ++i) {
            const double share = two_sided ? 0.5 : i < kBins ? 1.0 : 0.0;
            expected_lambert[i] = kSamples * share / kBins;
        }
        EXPECT_TRUE(chi_square(piece, expected).accepted()) << two_sided;
        EXPECT_TRUE(chi_square(lambert, expected_lambert).accepted()) << two_sided;
        std::swap(expected[0], expected[5]);
        EXPECT_FALSE(chi_square(piece, expected).accepted());
        EXPECT_NEAR(light->power(), kPiD * (areas[0] + areas[1]) * (two_sided ? 2 : 1), 1e-4);
    }
}

TEST(AreaLight, RingEmission_IsUniformBetweenItsRadii) {
    const auto light = make_area_light(DiskEmitter{{1, 2, 3}, {0, 0, 1}, 0.9F, 0.5F}, Rgb(1), false);
    constexpr int kSamples = 100000, kBins = 10;
    std::vector<std::uint64_t> counts(kBins * kBins);
    Sampler s(11, Purpose::test, 0, 0);
    for (int i = 0; i < kSamples; ++i) {
        const auto emitted = light->sample_Le(le_u(s));
        ASSERT_TRUE(emitted);
        const V3d p = V3d(emitted->from.p) - V3d(1, 2, 3);
        const double area = (p.length2() - 0.25) / (0.81 - 0.25);
        ASSERT_GT(area, -1e-5);
        ASSERT_LT(area, 1 + 1e-5);
        const double phi = std::atan2(p.y, p.x) / (2 * kPiD) + 0.5;
        const auto bin = [](double u) {
            return static_cast<std::size_t>(std::clamp(u * kBins, 0.0, kBins - 1.0));
        };
        ++counts[bin(area) * kBins + bin(phi)];
    }
    EXPECT_TRUE(chi_square(counts, std::vector<double>(kBins * kBins, kSamples / 100.0)).accepted());
}

TEST(AreaLight, SphereCone_IsSampledUniformly) {
    const SphereEmitter ball{{0, 0, 3}, 2};
    const auto light = make_area_light(ball, Rgb(1), false);
    const double h_max = 1 - std::sqrt(1 - 4.0 / 9);
    constexpr int kSamples = 100000, kBins = 12;
    std::vector<std::uint64_t> counts(kBins * kBins);
    Sampler s(9, Purpose::test, 0, 0);
    for (int i = 0; i < kSamples; ++i) {
        const auto light_sample = light->sample_Li({0, 0, 0}, s.next2());
        ASSERT_TRUE(light_sample);
        EXPECT_NEAR(static_cast<double>(light_sample->pdf_w), 1 / (2 * kPiD * h_max), 1e-6);
        const double h = (1 - static_cast<double>(light_sample->w.z)) / h_max;
        const double phi =
            std::atan2(static_cast<double>(light_sample->w.y), static_cast<double>(light_sample->w.x)) /
                (2 * kPiD) +
            0.5;
        const auto bin = [](double u) {
            return static_cast<std::size_t>(std::clamp(u * kBins, 0.0, kBins - 1.0));
        };
        ++counts[bin(h) * kBins + bin(phi)];
    }
    EXPECT_TRUE(
        chi_square(counts, std::vector<double>(kBins * kBins, kSamples / static_cast<double>(kBins * kBins)))
            .accepted());
}

TEST(AnalyticLight, WithoutPower_GivesNoSamples) {
    const SceneSphere scene;
    const DiskEmitter disk{{0, 0, 2}, {0, 0, -1}, 1};
    const V3f a(0, 0, 2), b(1, 0, 2);
    std::vector<std::unique_ptr<Light>> dark;
    dark.push_back(make_point_light({0, 0, 2}, Rgb(0)));
    dark.push_back(make_spot_light({0, 0, 2}, {0, 0, -1}, Rgb(0), {30, 5}));
    dark.push_back(make_distant_light({0, 0, -1}, Rgb(0), scene));
    dark.push_back(make_infinite_light(Rgb(0), scene));
    dark.push_back(make_area_light(disk, Rgb(0), false));
    dark.push_back(make_area_light(SphereEmitter{{0, 0, 2}, 1}, Rgb(0), true));
    dark.push_back(make_area_light(SphereEmitter{{0, 0, 2}, 0}, Rgb(1), true));
    dark.push_back(make_area_light(TriangleEmitter{}, Rgb(1), false));
    dark.push_back(make_area_light(TriangleEmitter{{a, b, a + b}, {{0, 1, 1}}, false}, Rgb(1), true));
    dark.push_back(make_area_light(TriangleEmitter{{a, b, V3f(NAN)}, {{0, 1, 2}}, false}, Rgb(1), true));
    dark.push_back(make_area_light(DiskEmitter{{0, 0, 2}, {0, 0, -1}, 1, 1}, Rgb(1), false));
    for (std::size_t i = 0; i < dark.size(); ++i) {
        EXPECT_EQ(dark[i]->power(), 0) << i;
        EXPECT_FALSE(dark[i]->sample_Le({{0.3F, 0.4F}, {0.5F, 0.6F}})) << i;
        EXPECT_FALSE(dark[i]->sample_Li({0, 0, 0}, {0.3F, 0.4F})) << i;
    }
}

TEST(AnalyticLight, AskedFromThePlaceItself_GivesNoSampleOrAFiniteOne) {
    for (const Lamp& lamp : all_lamps()) {
        Sampler s(10, Purpose::test, 0, 0);
        for (int i = 0; i < 2000; ++i) {
            const auto emitted = lamp.light->sample_Le(le_u(s));
            for (const V3f& x : {emitted->from.p, emitted->from.towards(emitted->d), V3f(0.5F, 0.4F, 2)}) {
                const auto light_sample = lamp.light->sample_Li(x, s.next2());
                if (!light_sample) continue;
                EXPECT_TRUE(is_finite(light_sample->weight) && std::isfinite(light_sample->pdf_w))
                    << lamp.name;
                EXPECT_TRUE(light_sample->distance >= 0) << lamp.name;
                EXPECT_NEAR(light_sample->w.length(), 1, 1e-5F) << lamp.name;
            }
        }
    }
}

TEST(AreaLight, BackOfOneSided_IsDarkAndOfTwoSidedIsNot) {
    const DiskEmitter disk{{0, 0, 2}, {0, 0, -1}, 1};
    const Ray from_behind{{0.1F, 0, 4}, {0, 0, -1}};
    const auto one = make_area_light(disk, Rgb(1), false);
    EXPECT_TRUE(is_black(one->Le_on_surface(from_behind, 2, disk.n, 0).radiance));
    EXPECT_FALSE(is_black(one->Le_on_surface({{0.1F, 0, 0}, {0, 0, 1}}, 2, disk.n, 0).radiance));
    const auto two = make_area_light(disk, Rgb(1), true);
    EXPECT_FALSE(is_black(two->Le_on_surface(from_behind, 2, disk.n, 0).radiance));
    EXPECT_TRUE(two->sample_Li(from_behind.o, {0.5F, 0.5F}));
    EXPECT_FLOAT_EQ(two->flux().x, 2 * one->flux().x);
}

TEST(InfiniteLight, Sky_IsSeenByRaysWithoutAnEnd) {
    const auto sky = make_infinite_light(Rgb(2), {});
    EXPECT_TRUE(sky->has_impostor());
    const auto seen = sky->Le({{0, 0, 0}, {0, 0, 1}});
    ASSERT_TRUE(seen);
    EXPECT_EQ(seen->radiance.x, 2);
    EXPECT_EQ(seen->distance, INFINITY);
    EXPECT_FLOAT_EQ(seen->pdf_w, sky->sample_Li({0, 0, 0}, {0.5F, 0.5F})->pdf_w);
    EXPECT_FALSE(sky->Le({{0, 0, 0}, {0, 0, 1}, 100}));
}

}  // namespace analytic_test
}  // namespace lucerna

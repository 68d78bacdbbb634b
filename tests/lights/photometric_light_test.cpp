// Lamps of photometric files that shine from their luminous opening: their particles, directions and radiance
// against each other, and illuminance against closed forms of evenly bright bodies.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <vector>

#include "engine/base/sampler.h"
#include "engine/base/warp.h"
#include "lights/opening_body.h"
#include "lights/photometric_files.h"
#include "lights/spherical_rectangle.h"
#include "tests/support/shared_data.h"
#include "tests/support/statistics.h"

namespace lucerna {
namespace photometric_light_test {

using Shape = LuminousOpening::Shape;
using testing::chi_square;

struct Body {
    const char* name;
    LuminousOpening opening;
};

const std::vector<Body>& bodies() {
    static const std::vector<Body> all{
        {"rectangle", {Shape::box, V3d(0.2, 1.2, 0)}},
        {"vertical rectangle", {Shape::cylinder_along_c0, V3d(0.5, 0, 0.3)}},
        {"box", {Shape::box, V3d(0.3, 0.6, 0.1)}},
        {"box with sides of different heights", {Shape::box, 0.3, 0.6, {0.2, 0.05, 0.1, 0}}},
        {"disc", {Shape::cylinder_upright, V3d(0.3, 0.3, 0)}},
        {"ellipse", {Shape::ellipsoid, V3d(0.3, 0.7, 0)}},
        {"vertical ellipse", {Shape::cylinder_along_c0, V3d(0, 0.3, 0.2)}},
        {"upright cylinder", {Shape::cylinder_upright, V3d(0.3, 0.2, 0.4)}},
        {"cylinder with sides of different heights",
         {Shape::cylinder_upright, 0.3, 0.3, {0.2, 0.05, 0.1, 0}}},
        {"cylinder along C0", {Shape::cylinder_along_c0, V3d(1.2, 0.1, 0.1)}},
        {"cylinder along C90", {Shape::cylinder_along_c90, V3d(0.1, 0.8, 0.2)}},
        {"sphere", {Shape::ellipsoid, V3d(0.3, 0.3, 0.3)}},
        {"ellipsoid", {Shape::ellipsoid, V3d(0.5, 0.2, 0.1)}},
    };
    return all;
}

// Returns a web of C planes on even steps, with candela of the direction. Its opening is `opening`.
std::shared_ptr<const PhotometricWeb> web_of(const LuminousOpening& opening, double step,
                                             const std::function<double(const V3d&)>& candela) {
    PhotometricGrid grid;
    for (double polar = 0; polar <= 180; polar += step) grid.polar.push_back(polar);
    for (double azimuth = 0; azimuth <= 360; azimuth += step) grid.azimuth.push_back(azimuth);
    for (const double azimuth : grid.azimuth) {
        for (const double polar : grid.polar) {
            const double theta = polar * kRadiansPerDegree, phi = azimuth * kRadiansPerDegree;
            grid.candela.push_back(static_cast<float>(candela(
                {std::sin(theta) * std::cos(phi), -std::sin(theta) * std::sin(phi), std::cos(theta)})));
        }
    }
    PhotometricInfo info;
    info.opening = opening;
    return std::make_shared<const PhotometricWeb>(std::move(grid), info);
}

// A web without symmetry that is dark nowhere.
std::shared_ptr<const PhotometricWeb> odd_web(const LuminousOpening& opening) {
    return web_of(opening, 15, [](const V3d& w) { return 200 + 80 * w.x + 50 * w.y + 60 * w.z; });
}

std::unique_ptr<Light> light_of(std::shared_ptr<const PhotometricWeb> web, const LampPlace& place = {}) {
    return make_photometric_light("ies", std::move(web), place, Rgb(1.0F));
}

double largest(const LuminousOpening& opening) {
    return std::max({opening.size.x, opening.size.y, opening.size.z});
}

// Returns the cone from x that holds a ball around the middle: 1 - cosine of its half-angle, 2 from inside.
float cone_around_middle(const V3f& x, double radius) {
    const double sin2 = sqr(radius / double{x.length()});
    return sin2 < 1 ? static_cast<float>(1 - std::sqrt(1 - sin2)) : 2.0F;
}

// Compares what sample_Li() finds with what Le() finds along directions that are uniform in a cone: radiance
// and probability. `wrong` multiplies the densities of Le().
struct Consistency {
    double worst = 0;      // largest difference of both integrals, in standard errors
    int beside = 0;        // samples along which Le() finds something else
    double variation = 0;  // relative standard deviation of the weights
};
Consistency consistency_at(const Light& light, const V3f& x, double radius, int samples, double wrong = 1) {
    RunningStats li, li_found, le, le_pdf;
    Consistency found;
    const float cone = cone_around_middle(x, radius);
    const Frame frame((-x).normalized());
    for (int i = 0; i < samples; ++i) {
        Sampler s(7, Purpose::test, 0, static_cast<std::uint64_t>(i));
        const auto in = light.sample_Li(x, s.next2());
        li.add(in ? double{in->weight.y} : 0.0);
        li_found.add(in ? 1.0 : 0.0);
        if (in) {
            const auto back = light.Le({x, in->w});
            const bool same = back && std::fabs(back->pdf_w / in->pdf_w - 1) < 1e-3F &&
                              std::fabs(back->radiance.y / (in->weight.y * in->pdf_w) - 1) < 1e-3F &&
                              std::fabs(back->distance - in->distance) < 1e-3F * in->distance + 1e-5F;
            found.beside += !same;
        }
        const V3f w = frame.to_world(square_to_cone(s.next2(), cone));
        const auto seen = light.Le({x, w.normalized()});
        const double solid_angle = 2 * kPiD * double{cone};
        le.add(seen ? double{seen->radiance.y} * solid_angle : 0.0);
        le_pdf.add(seen ? wrong * double{seen->pdf_w} * solid_angle : 0.0);
    }
    const auto differ = [](const RunningStats& a, const RunningStats& b) {
        const double error = std::hypot(a.standard_error(), b.standard_error()) + 1e-6 * std::fabs(b.mean());
        return error > 0 ? std::fabs(a.mean() - b.mean()) / error : 0.0;
    };
    found.worst = std::max(differ(li, le), differ(li_found, le_pdf));
    found.variation = li.mean() > 0 ? std::sqrt(li.variance()) / li.mean() : 0.0;
    return found;
}

// Places in contact with the box around the body, near it, and at several times its size, on all sides.
std::vector<V3f> places_around(const OpeningBody& body) {
    std::vector<V3f> places;
    for (const double reach : {1.02, 1.3, 2.5, 6.0}) {
        for (const V3d& side : {V3d(0, 0, 1), V3d(0, 0, -1), V3d(1, 0.2, 0.1), V3d(-0.3, -1, 0.4),
                                V3d(0.7, -0.7, 1), V3d(-1, 1, -1)}) {
            const V3d place = side * (reach * body.half() + V3d(0.01 + 0.1 * (reach - 1)));
            places.emplace_back(place);
        }
    }
    return places;
}

TEST(OpeningLight, DirectionsAndRadiance_AgreeAtEveryPlace) {
    for (const Body& body : bodies()) {
        const auto light = light_of(odd_web(body.opening));
        const OpeningBody whole(body.opening, 1);
        constexpr int kSamples = 4000;
        for (const V3f& x : places_around(whole)) {
            const Consistency found = consistency_at(*light, x, whole.half().length() * 1.0001, kSamples);
            EXPECT_LT(found.worst, 4.5) << body.name << " from " << x;
            EXPECT_LT(found.beside, 0.004 * kSamples) << body.name << " from " << x << ": beside its edge";
            // Most directions miss a round body that is seen over the corner of its box.
            EXPECT_LT(found.variation, 4) << body.name << " from " << x;
        }
    }
}

TEST(OpeningLight, WrongDensity_IsDetected) {
    const auto light = light_of(odd_web(bodies()[2].opening));
    EXPECT_GT(consistency_at(*light, {0.1F, 0.4F, 0.5F}, 0.4, 20'000, 1.1).worst, 4.5);
}

// A strip of 1.2 m at 10 cm: samples are uniform in solid angle, and the light is nearly that of an even
// body.
TEST(OpeningLight, LongStripCloseBy_HasLittleNoise) {
    const LuminousOpening strip(Shape::box, V3d(0.05, 1.2, 0));
    const auto light = light_of(web_of(strip, 5, [](const V3d& w) { return 100 * std::fabs(w.z); }));
    for (const V3f& x : {V3f(0, 0, 0.1F), V3f(0.1F, 0.55F, 0.02F), V3f(0.03F, -0.2F, -0.01F)})
        EXPECT_LT(consistency_at(*light, x, 0.61, 1000).variation, 0.02) << x;
}

TEST(OpeningLight, PlacesInside_ReceiveNothing) {
    for (const Body& body : bodies()) {
        if (body.opening.flat()) continue;
        const auto light = light_of(odd_web(body.opening));
        for (const double share : {0.0, 0.5}) {
            const V3f x(share * OpeningBody(body.opening, 1).half());
            for (int i = 0; i < 200; ++i) {
                Sampler s(3, Purpose::test, 0, static_cast<std::uint64_t>(i));
                EXPECT_FALSE(light->sample_Li(x, s.next2())) << body.name;
                EXPECT_FALSE(light->Le({x, square_to_sphere(s.next2())})) << body.name;
            }
        }
    }
}

TEST(OpeningLight, Particles_HaveTheFilesFluxAndFarField) {
    constexpr int kParticles = 40'000, kRows = 6, kColumns = 8, kFine = 40;
    for (const Body& body : bodies()) {
        const auto web = odd_web(body.opening);
        const auto light = light_of(web);
        std::vector<std::uint64_t> counts(kRows * kColumns);
        std::uint64_t emitted = 0;
        for (int i = 0; i < kParticles; ++i) {
            Sampler s(5, Purpose::test, 0, static_cast<std::uint64_t>(i));
            const auto particle = light->sample_Le({s.next2(), s.next2(), 0});
            if (!particle) continue;
            ++emitted;
            EXPECT_EQ(double{particle->weight.y}, double{light->flux().y});
            EXPECT_GT(particle->from.n.dot(particle->d), 0);
            const double row = std::min(kRows * 0.5 * (1 + double{particle->d.z}), kRows - 1e-9);
            const double turn = std::atan2(particle->d.y, particle->d.x) / (2 * kPiD) + 0.5;
            const double column = std::min(kColumns * turn, kColumns - 1e-9);
            ++counts[static_cast<std::size_t>(row) * kColumns + static_cast<std::size_t>(column)];
        }
        EXPECT_EQ(emitted, kParticles) << body.name;
        std::vector<double> expected;
        for (int bin = 0; bin < kRows * kColumns; ++bin) {
            double sum = 0;
            for (int k = 0; k < kFine * kFine; ++k) {
                const double z = 2 * (bin / kColumns + (k / kFine + 0.5) / kFine) / kRows - 1;
                const double phi = (bin % kColumns + (k % kFine + 0.5) / kFine) / kColumns * 2 * kPiD - kPiD;
                const double r = std::sqrt(1 - z * z);
                sum += web->intensity({r * std::cos(phi), r * std::sin(phi), z});
            }
            expected.push_back(sum * 4 * kPiD / (kRows * kColumns * kFine * kFine) / web->flux() *
                               kParticles);
        }
        EXPECT_TRUE(chi_square(counts, expected).accepted()) << body.name;
    }
}

// All light crosses a box around the body. In each piece of it, the flux of particles is that of directions.
struct Crossing {
    int piece;
    V3d p;
};
Crossing crossing_of(const V3d& half, const V3d& from, const V3d& d, int across) {
    double t = INFINITY;
    int axis = 0;
    for (int a = 0; a < 3; ++a) {
        if (d[a] == 0) continue;
        const double to = (std::copysign(half[a], d[a]) - from[a]) / d[a];
        if (to < t) t = to, axis = a;
    }
    const V3d p = from + t * d;
    const auto cell = [&](int a) {
        return std::clamp(static_cast<int>(across * 0.5 * (1 + p[a] / half[a])), 0, across - 1);
    };
    const int face = 2 * axis + (d[axis] > 0 ? 1 : 0);
    return {(face * across + cell((axis + 1) % 3)) * across + cell((axis + 2) % 3), p};
}

TEST(OpeningLight, Particles_CrossEveryPieceOfABoxAsDirectionsSay) {
    constexpr int kAcross = 3, kParticles = 60'000, kSamples = 3000;
    for (const Body& body : bodies()) {
        const auto light = light_of(odd_web(body.opening));
        const V3d half = 1.15 * OpeningBody(body.opening, 1).half() + V3d(0.05);
        std::vector<double> counts(6 * kAcross * kAcross);
        for (int i = 0; i < kParticles; ++i) {
            Sampler s(9, Purpose::test, 0, static_cast<std::uint64_t>(i));
            const auto particle = light->sample_Le({s.next2(), s.next2(), 0});
            ASSERT_TRUE(particle);
            ++counts[static_cast<std::size_t>(
                crossing_of(half, V3d(particle->from.p), V3d(particle->d), kAcross).piece)];
        }
        for (std::size_t piece = 0; piece < counts.size(); ++piece) {
            const int face = static_cast<int>(piece) / (kAcross * kAcross), axis = face / 2;
            const int b = (axis + 1) % 3, c = (axis + 2) % 3;
            const int row = static_cast<int>(piece) / kAcross % kAcross,
                      column = static_cast<int>(piece) % kAcross;
            RunningStats flux;
            for (int i = 0; i < kSamples; ++i) {
                Sampler s(10 + piece, Purpose::test, 0, static_cast<std::uint64_t>(i));
                const V2f u = s.next2();
                V3d x, inward(0, 0, 0);
                inward[axis] = face % 2 == 1 ? -1 : 1;
                x[axis] = -inward[axis] * half[axis];
                x[b] = half[b] * (2 * (row + double{u.x}) / kAcross - 1);
                x[c] = half[c] * (2 * (column + double{u.y}) / kAcross - 1);
                const auto in = light->sample_Li(V3f(x), s.next2());
                flux.add(in ? double{in->weight.y} * inward.dot(V3d(in->w)) * 4 * half[b] * half[c] /
                                  (kAcross * kAcross)
                            : 0.0);
            }
            const double share = counts[piece] / kParticles, whole = double{light->flux().y};
            const double error =
                std::hypot(whole * std::sqrt(share * (1 - share) / kParticles), flux.standard_error());
            EXPECT_LE(std::fabs(whole * share - flux.mean()), 4.5 * error) << body.name << ", " << piece;
        }
    }
}

// Returns the irradiance at x of a surface with normal n, by points of a lattice.
double irradiance(const Light& light, const V3d& x, const V3d& n, int samples = 20'000) {
    double sum = 0;
    for (int i = 0; i < samples; ++i) {
        // [Roberts 2018]
        const double a = 0.5 + 0.7548776662466927 * i, b = 0.5 + 0.5698402909980532 * i;
        const V2f u(static_cast<float>(a - std::floor(a)), static_cast<float>(b - std::floor(b)));
        const auto in = light.sample_Li(V3f(x), {std::min(u.x, 0.9999999F), std::min(u.y, 0.9999999F)});
        if (in) sum += double{in->weight.y} * std::max(0.0, n.dot(V3d(in->w)));
    }
    return sum / samples;
}

// An evenly bright body of luminance 1000 cd/m².
std::unique_ptr<Light> even(const LuminousOpening& opening) {
    return light_of(web_of(opening, 1, [&](const V3d& w) { return 1000 * opening.projected_area(w); }));
}

constexpr double kDistances[] = {0.001, 0.01, 0.1, 0.3, 1, 3, 10};

// Linear interpolation over steps of 1 degree is wrong by up to 4e-5 of a cosine.
constexpr double kGridError = 2e-4;

TEST(OpeningLight, EvenDisc_HasItsClosedForm) {
    const double r = 0.15;
    const auto light = even({Shape::cylinder_upright, V3d(2 * r, 2 * r, 0)});
    for (const double z : kDistances) {
        const double expected = kPiD * 1000 * r * r / (r * r + z * z);
        EXPECT_NEAR(irradiance(*light, {0, 0, z}, {0, 0, -1}) / expected, 1, 2e-3) << z;
        EXPECT_NEAR(irradiance(*light, {0, 0, -z}, {0, 0, 1}) / expected, 1, 2e-3) << -z;
    }
}

TEST(OpeningLight, EvenSquare_HasItsClosedForm) {
    const double a = 0.3;  // half of its side
    const auto light = even({Shape::box, V3d(2 * a, 2 * a, 0)});
    for (const double z : kDistances) {
        // Four times the configuration factor of a corner's rectangle, for a parallel plane.
        const double x = a / std::hypot(a, z);
        const double expected = 1000 * 4 * x * std::atan(x);
        EXPECT_NEAR(irradiance(*light, {0, 0, z}, {0, 0, -1}) / expected, 1, kGridError) << z;
    }
}

TEST(OpeningLight, EvenSphere_HasItsClosedForm) {
    const double r = 0.15;
    const auto light = even({Shape::ellipsoid, V3d(2 * r)});
    for (const double gap : kDistances) {
        const double d = r + gap, expected = kPiD * 1000 * sqr(r / d);
        const V3d side = V3d(0.48, 0.6, 0.64);
        EXPECT_NEAR(irradiance(*light, d * side, -side) / expected, 1, 3e-3) << gap;
    }
}

// Sums an evenly bright convex surface by small pieces that face x. `point` and `normal` are functions of two
// parameters in [0, 1], and `area` is that of a piece.
template <typename Piece>
double by_pieces(const V3d& x, const V3d& n, int steps, Piece&& piece) {
    double sum = 0;
    for (int i = 0; i < steps; ++i) {
        for (int j = 0; j < steps; ++j) {
            const auto [p, da] = piece((i + 0.5) / steps, (j + 0.5) / steps);
            const V3d way = p - x;
            const double d2 = way.length2();
            sum += 1000 * std::max(0.0, n.dot(way)) * std::max(0.0, -da.dot(way)) / (d2 * d2);
        }
    }
    return sum / (steps * steps);
}

TEST(OpeningLight, EvenTubeAndBox_HaveTheSumsOfTheirPieces) {
    const double length = 1.2, r = 0.02;
    const auto tube = even({Shape::cylinder_along_c0, V3d(length, 2 * r, 2 * r)});
    const V3d size(0.3, 0.6, 0.1);
    const auto box = even({Shape::box, size});
    for (const double gap : {0.01, 0.1, 0.3, 1.0, 3.0, 10.0}) {
        const V3d down(0, 0, -1), x(0.1, 0.3 * gap, r + gap);
        const double side = by_pieces(x, down, 1500, [&](double u, double v) {
            const double phi = 2 * kPiD * v;
            const V3d n(0, std::sin(phi), std::cos(phi));
            return std::pair(V3d(length * (u - 0.5), 0, 0) + r * n, 2 * kPiD * r * length * n);
        });
        EXPECT_NEAR(irradiance(*tube, x, down) / side, 1, 4e-3) << "tube " << gap;
        const V3d y(0.1, 0.3 + gap, 0.05 + gap);
        const double bottom = by_pieces(y, down, 1000, [&](double u, double v) {
            return std::pair(V3d(size.x * (u - 0.5), size.y * (v - 0.5), 0.05), V3d(0, 0, size.x * size.y));
        });
        const double front = by_pieces(y, down, 1000, [&](double u, double v) {
            return std::pair(V3d(size.x * (u - 0.5), 0.3, size.z * (v - 0.5)), V3d(0, size.x * size.z, 0));
        });
        EXPECT_NEAR(irradiance(*box, y, down) / (bottom + front), 1, 1e-3) << "box " << gap;
    }
}

TEST(OpeningLight, MovedTurnedAndEnlarged_ShinesAlike) {
    const auto web = odd_web({Shape::box, 0.3, 0.6, {0.2, 0.05, 0.1, 0}});
    // Mirrored: lamps' axes may be of either handedness.
    const LightAxes axes{{0, 0, -1}, {0.6F, 0.8F, 0}, {0.8F, -0.6F, 0}};
    const LampPlace place{{3, -2, 1}, axes, 2.5F};
    const auto at_origin = light_of(web), placed = light_of(web, place);
    for (const V3d& x : {V3d(0.4, 0.3, 0.5), V3d(-1, 2, -0.4), V3d(3, 2, 9)}) {
        const V3d n = -x.normalized();
        const V3d there = V3d(place.position) + 2.5 * V3d(axes.to_world(V3f(x)));
        const double expected = irradiance(*at_origin, x, n, 4000) / sqr(2.5);
        EXPECT_NEAR(irradiance(*placed, there, V3d(axes.to_world(V3f(n))), 4000) / expected, 1, 1e-3) << x;
    }
    const auto bounds = placed->bounds();
    ASSERT_TRUE(bounds);
    EXPECT_NEAR((bounds->box.center() - place.position).length(), 0, 1e-5F);
    EXPECT_NEAR(bounds->box.size().z, 0.3F * 2.5F, 1e-5F);
}

TEST(OpeningLight, WithoutAnOpeningWithArea_IsAPoint) {
    EXPECT_TRUE(light_of(odd_web({}))->is_delta());
    EXPECT_TRUE(light_of(odd_web({Shape::box, V3d(0, 1, 0)}))->is_delta()) << "a line";
    EXPECT_TRUE(light_of(odd_web(bodies()[0].opening), {V3f(0.0F), {}, 1e-12F})->is_delta())
        << "too small for float32";
    const auto light = light_of(odd_web(bodies()[0].opening));
    EXPECT_FALSE(light->is_delta());
    EXPECT_TRUE(light->has_impostor());
}

// Two metres below a strip of 1.17 m, the inverse square law is 5 % too high.
TEST(OpeningLight, StripOfARealFile_IsDimmerBelowThanAPoint) {
    LUCERNA_NEED_DATA(file, std::filesystem::path("photometry") / "fluorescent_luminaire.ldt");
    Monitor silent;
    PhotometricWeb web = read_photometric(file, silent);
    const V3d below(0, 0, 2), up(0, 0, -1);
    // A place of the flat opening, whose face has the area A0, contributes I/A0 cosθ/r².
    constexpr int kSteps = 400;
    double expected = 0;
    for (int i = 0; i < kSteps * kSteps; ++i) {
        const V3d from(0.09 * ((i / kSteps + 0.5) / kSteps - 0.5), 1.17 * ((i % kSteps + 0.5) / kSteps - 0.5),
                       0);
        const V3d way = below - from;
        const double r = way.length();
        expected += web.intensity(way / r) * way.z / (r * r * r) / (kSteps * kSteps);
    }
    EXPECT_NEAR(expected, 261.1, 0.05);
    EXPECT_NEAR(irradiance(*light_of(std::make_shared<const PhotometricWeb>(web)), below, up), expected,
                1e-4 * expected);
    web.set_opening({});
    EXPECT_NEAR(irradiance(*light_of(std::make_shared<const PhotometricWeb>(web)), below, up), 275.4, 0.1);
}

TEST(SphericalRectangle, SolidAngle_IsThatOfTheClosedForm) {
    // These are a face of a cube seen from its middle, a quarter of a plane, and a distant small one.
    EXPECT_NEAR(SphericalRectangle(-1, 1, -1, 1, 1).solid_angle(), 4 * kPiD / 6, 1e-14);
    EXPECT_NEAR(SphericalRectangle(0, 1e9, 0, 1e9, 1).solid_angle(), kPiD / 2, 1e-8);
    EXPECT_NEAR(SphericalRectangle(2.9995, 3.0005, 3.999, 4.001, 12).solid_angle(), 2e-6 * 12 / (13 * 169),
                1e-12);
}

}  // namespace photometric_light_test
}  // namespace lucerna

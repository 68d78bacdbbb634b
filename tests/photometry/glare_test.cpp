// Compares UGR with its formula for luminaires whose luminance, solid angle and background have closed forms.
#include "engine/photometry/glare.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <fstream>

#include "engine/base/error.h"
#include "engine/pbrt/read_scene.h"
#include "lights/light_field.h"
#include "lights/luminous_opening.h"
#include "lights/measurement/acquire.h"
#include "tests/support/temporary_folder.h"

namespace lucerna {
namespace glare_test {

constexpr double kDegree = kPiD / 180;
constexpr double kRadius = 5, kRho = 0.95;  // of an integrating sphere

Job job_of(const std::string& world) {
    Monitor silent;
    return read_scene_text(
        "Option \"string unit\" \"photometric\" Camera \"perspective\" Film \"rgb\" WorldBegin\n" + world,
        "scene.pbrt", {}, Workers{2}, silent);
}

// A disc of radius `r` and luminance `l` in an integrating sphere. It faces the sphere's centre from the
// distance d, `above` degrees above the axis y and turned about it, and its back is black.
struct Disc {
    double r, l, d, above, turned = 0;
};
std::string sphere_with(const std::vector<Disc>& discs, double rho = kRho) {
    std::string text = fmt::format(
        "Material \"diffuse\" \"rgb reflectance\" [{0} {0} {0}]\nShape \"sphere\" \"float radius\" {1}\n"
        "Material \"diffuse\" \"rgb reflectance\" [0 0 0]\n",
        rho, kRadius);
    for (const Disc& disc : discs) {
        text += fmt::format(
            "AttributeBegin AreaLightSource \"diffuse\" \"rgb L\" [{0} {0} {0}]\nRotate {1} 0 1 0 Rotate {2} "
            "1 0 0 Translate "
            "0 0 {3} Rotate 180 1 0 0\nShape \"disk\" \"float radius\" {4}\nAttributeEnd\n",
            disc.l, disc.turned, -disc.above, disc.d, disc.r);
    }
    return text;
}
// Returns the background of the reflected light, which is uniform in the sphere because the discs are small.
// Only the first of twenty reflections is not uniform.
double background_of(const std::vector<Disc>& discs) {
    double flux = 0;
    for (const Disc& disc : discs) flux += kPiD * kPiD * disc.r * disc.r * disc.l;
    return flux * kRho / (1 - kRho) / (4 * kPiD * kRadius * kRadius) / kPiD;
}

GlareReport rate(const std::vector<Disc>& discs, double blur = 0) {
    const Observer observer{"middle", {0, 0, 0}, {0, 0, 1}, {0, 1, 0}};
    Monitor silent;
    GlareOptions options;
    options.workers = {2};
    options.blur = blur;
    options.precision = 0.03;
    return glare_at(std::vector{observer}, job_of(sphere_with(discs)), options, silent)[0];
}

TEST(PositionIndex, IsGuthsFit) {
    EXPECT_DOUBLE_EQ(position_index(0, 0), 1);
    EXPECT_DOUBLE_EQ(position_index(180, 0), 1);
    // Values of CIE 117's table by T/R and H/R: straight above the line of sight, where H/R = tan(s), and to
    // the side.
    EXPECT_NEAR(position_index(0, std::atan(0.5) / kDegree), 2.86, 0.15);
    EXPECT_NEAR(position_index(0, std::atan(1.0) / kDegree), 6.9, 0.5);
    EXPECT_NEAR(position_index(90, std::atan(1.0) / kDegree), 2.2, 0.2);
}

// The discs are small, so the position index hardly varies over them.
TEST(Glare, OfEvenDiscs_IsTheFormulaOfCie117) {
    const std::vector<Disc> discs{{0.05, 20000, 3, 20}, {0.04, 15000, 2.5, 35, 30}};
    const GlareReport report = rate(discs);
    ASSERT_EQ(report.sources.size(), 2U);
    double sum = 0;
    for (std::size_t i = 0; i < 2; ++i) {
        const Disc& disc = discs[i];
        const double solid_angle = 2 * kPiD * (1 - disc.d / std::hypot(disc.d, disc.r));
        const V3d w(std::sin(disc.turned * kDegree) * std::cos(disc.above * kDegree),
                    std::sin(disc.above * kDegree),
                    std::cos(disc.turned * kDegree) * std::cos(disc.above * kDegree));
        const double p = position_index({"", {}, {0, 0, 1}, {0, 1, 0}}, V3f(w));
        const GlareSource& source = report.sources[i];
        EXPECT_NEAR(source.solid_angle, solid_angle, 0.01 * solid_angle);
        EXPECT_NEAR(source.luminance, disc.l, 1e-3 * disc.l);
        EXPECT_NEAR(source.position, p, 0.02 * p);
        sum += disc.l * disc.l * solid_angle / (p * p);
    }
    const double background = background_of(discs);
    EXPECT_NEAR(report.background.value, background, 0.06 * background);
    const double ugr = 8 * std::log10(0.25 / report.background.value * sum);
    EXPECT_NEAR(report.ugr.value, ugr, 0.05);
    EXPECT_NEAR(report.ugr_even.value, ugr, 0.05);
}

// The luminaire's direct light at the eye is nearly free of noise and exceeds all that a dark sphere
// reflects.
TEST(Glare, Precision_HoldsForTheBackgroundAndTheEye) {
    const Observer observer{"middle", {0, 0, 0}, {0, 0, 1}, {0, 1, 0}};
    Monitor silent;
    GlareOptions options;
    options.workers = {2};
    options.precision = 0.003;
    const GlareReport report =
        glare_at(std::vector{observer}, job_of(sphere_with({{0.2, 20000, 3, 20}}, 0.1)), options, silent)[0];
    const double of_background = report.background.half_width / report.background.value;
    EXPECT_LE(of_background, options.precision);
    EXPECT_GT(of_background, options.precision / 3) << "no more samples than it takes";
    EXPECT_LT(kPiD * report.background.value, 0.2 * report.vertical.value);
    EXPECT_LT(report.vertical.half_width, options.precision / 3 * report.vertical.value);
}

// A chip much smaller than the filter appears as a Gaussian, whose squared integral is (L a)² / (4 pi s²).
TEST(Glare, Long_OfAChip_IsThatOfTheFilteredLuminance) {
    const Disc chip{0.0005, 1e8, 1, 10};
    const GlareReport sharp = rate({chip}), blurred = rate({chip}, 0.012);
    const double area = kPiD * chip.r * chip.r;  // sr, from 1 m
    const double s = 0.012 / 2.3548, p = position_index(0, 10);
    EXPECT_NEAR(sharp.sources[0].seen.value, chip.l * chip.l * area / (p * p),
                0.01 * chip.l * chip.l * area / (p * p));
    const double expected = std::pow(chip.l * area, 2) / (4 * kPiD * s * s) / (p * p);
    EXPECT_NEAR(blurred.sources[0].seen.value, expected,
                0.02 * expected + 2 * blurred.sources[0].seen.half_width);
    EXPECT_LT(blurred.sources[0].seen.half_width, 0.2 * expected);
}

// The effective part of an even disc, filtered: the luminance at a distance from its middle is an integral
// over the disc, which falls with this distance, so the part above 500 cd/m² is a disc, too.
struct EffectiveDisc {
    double area = 0, luminance = 0;  // on the luminaire
};
EffectiveDisc effective_disc(double radius, double luminance, double sigma) {
    constexpr int kSteps = 4000;
    const double end = radius + 6 * sigma, step = end / kSteps;
    EffectiveDisc part;
    double flux = 0;
    for (int i = 0; i < kSteps; ++i) {
        const double at = (i + 0.5) * step;
        double seen = 0;
        constexpr int kRings = 400;
        for (int k = 0; k < kRings; ++k) {
            const double r = (k + 0.5) * radius / kRings, x = at * r / (sigma * sigma);
            // exp(-(at² + r²) / 2σ²) I_0(x), in which both factors may overflow for themselves.
            const double bessel =
                x < 500 ? std::cyl_bessel_i(0, x) * std::exp(-x) : 1 / std::sqrt(2 * kPiD * x);
            seen += luminance * r / (sigma * sigma) * bessel * std::exp(-sqr(at - r) / (2 * sigma * sigma)) *
                    radius / kRings;
        }
        if (!(seen > 500)) continue;
        part.area += 2 * kPiD * at * step;
        flux += seen * 2 * kPiD * at * step;
    }
    if (part.area > 0) part.luminance = flux / part.area;
    return part;
}

TEST(Glare, Long_OfEffectiveParts_IsCie232s) {
    constexpr double kBlur = 0.012;
    for (const Disc& disc : {Disc{0.05, 20000, 3, 20}, Disc{0.02, 3000, 1.5, 15}, Disc{0.001, 1e7, 2, 10}}) {
        const GlareReport report = rate({disc}, kBlur);
        const EffectiveDisc part = effective_disc(disc.r, disc.l, kBlur / 2.3548200450309493);
        const double solid_angle = part.area / sqr(disc.d), p = position_index(0, disc.above);
        const EffectivePart& found = report.sources.at(0).effective;
        EXPECT_NEAR(found.solid_angle, solid_angle, 0.03 * solid_angle) << disc.r;
        EXPECT_NEAR(found.luminance, part.luminance, 0.03 * part.luminance) << disc.r;
        const double term = sqr(part.luminance) * solid_angle / sqr(p);
        EXPECT_NEAR(found.term.value, term, 2 * found.term.half_width + 0.03 * term) << disc.r;
        EXPECT_LT(found.term.half_width, 0.1 * term) << disc.r;
        EXPECT_NEAR(report.ugr_effective.value, 8 * std::log10(0.25 / report.background.value * term), 0.15);
    }
    // A panel of 400 cd/m² has no effective part.
    const GlareReport faint = rate({{0.1, 400, 2, 20}}, kBlur);
    EXPECT_EQ(faint.sources.at(0).effective.solid_angle, 0);
    EXPECT_EQ(faint.ugr_effective.value, -INFINITY);
    EXPECT_GT(faint.ugr.value, -INFINITY);
    EXPECT_EQ(rate({{0.05, 20000, 3, 20}}).ugr_effective.value, -INFINITY) << "without a filter";
}

TEST(Glare, Long_OfWhatIsHiddenOrBehind_IsNone) {
    EXPECT_TRUE(std::isinf(rate({{0.1, 1e4, 2, 180}}).ugr.value));
    std::string hidden = sphere_with({{0.1, 1e4, 3, 0}});
    hidden += "Translate 0 0 1 Shape \"disk\" \"float radius\" 0.5\n";
    const Observer observer{"middle", {0, 0, 0}, {0, 0, 1}, {0, 1, 0}};
    Monitor silent;
    GlareOptions options;
    options.workers = {2};
    options.precision = 0.1;
    EXPECT_TRUE(glare_at(std::vector{observer}, job_of(hidden), options, silent)[0].sources.empty());
}

// Sums `value(w)` over the solid angle of a flat or curved piece of surface, seen from `eye`. `place` gives a
// point and the outward normal times the piece's area for two parameters in [0, 1]; w leads to the eye.
template <typename Place, typename Value>
double over_solid_angle(const V3d& eye, Place&& place, Value&& value) {
    constexpr int kSteps = 400;
    double sum = 0;
    for (int i = 0; i < kSteps * kSteps; ++i) {
        const auto [p, da] = place((i / kSteps + 0.5) / kSteps, (i % kSteps + 0.5) / kSteps);
        const V3d way = eye - p;
        const double r = way.length();
        sum += std::max(0.0, da.dot(way)) / (r * r * r) * value(V3d(way / r));
    }
    return sum / (kSteps * kSteps);
}
constexpr auto kOne = [](const V3d&) { return 1.0; };

// A far field of I = 400 cd in all directions, 3 m away, has an opening of 0.6 m x 0.3 m x 0.1 m seen from
// below at 30 degrees from its nadir: L = I / A, ω = A / d².
TEST(Glare, Long_OfAPhotometricFile_IsByItsLuminousOpening) {
    const testing::TemporaryFolder folder;
    const auto rating = [&](const std::string& opening) {
        std::ofstream(folder / "lamp.ies")
            << "IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 2 1 1 2 " << opening << "\n1 1 9\n0 180\n0\n400 400\n";
        // The eye looks from the centre along z: the lamp is 60 degrees above the line of sight, with its
        // nadir straight down (-y).
        const std::string lamp = fmt::format(
            "AttributeBegin Translate 0 {} {} Rotate 90 1 0 0\nLightSource \"ies\" \"string filename\" "
            "\"{}\"\nAttributeEnd\n",
            3 * std::sin(60 * kDegree), 3 * std::cos(60 * kDegree), (folder / "lamp.ies").string());
        Monitor silent;
        GlareOptions options;
        options.workers = {2};
        options.precision = 0.02;
        options.blur = 0;
        const Observer observer{"middle", {0, 0, 0}, {0, 0, 1}, {0, 1, 0}};
        return glare_at(std::vector{observer}, job_of(sphere_with({}) + lamp), options, silent)[0];
    };
    const GlareReport report = rating("0.3 0.6 0.1");
    ASSERT_EQ(report.sources.size(), 1U);
    // The file states the width, along C90 and here along z, before the length.
    const double area = 0.6 * 0.3 * std::cos(30 * kDegree) + 0.1 * 0.6 * std::sin(30 * kDegree);
    const double p = position_index(0, 60);
    const double background = 4 * kPiD * 400 * kRho / (1 - kRho) / (4 * kPiD * kRadius * kRadius) / kPiD;
    // A and d vary over the body by its size over the distance squared, 1 %.
    EXPECT_NEAR(report.sources[0].solid_angle, area / 9, 0.01 * area / 9);
    EXPECT_NEAR(report.sources[0].luminance, 400 / area, 0.01 * 400 / area);
    // The lamp is off the centre, so the first of twenty reflections is not uniform.
    EXPECT_NEAR(report.background.value, background, 0.03 * background);
    const double expected =
        8 * std::log10(0.25 / report.background.value * (400 / area) * (400.0 / 9) / (p * p));
    EXPECT_NEAR(report.ugr.value, expected, 0.05);
    EXPECT_NEAR(report.ugr_even.value, expected, 0.05);
    EXPECT_TRUE(rating("0 0 0").sources.empty());
}

// Rates a lamp in a room of two planes of reflectance 0.5, seen from (0, 1.2, 0) along `view`.
GlareReport rate_in_room(const std::string& lamp, double height, const V3f& view) {
    const testing::TemporaryFolder folder;
    const std::string text = fmt::format(
        "Material \"diffuse\" \"rgb reflectance\" [0.5 0.5 0.5]\n"
        "Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] "
        "\"point3 P\" [-4 0 -4 -4 0 4 8 0 4 8 0 -4]\n"
        "Shape \"trianglemesh\" \"integer indices\" [0 1 2 0 2 3] "
        "\"point3 P\" [-4 3 -4 8 3 -4 8 3 4 -4 3 4]\n"
        "AttributeBegin Translate 3 {} 0 Rotate 90 1 0 0\n{}\nAttributeEnd\n",
        height, lamp);
    Monitor silent;
    GlareOptions options;
    options.workers = {2};
    options.precision = 0.01;
    options.blur = 0;
    const Observer observer{"eye", {0, 1.2, 0}, view, {0, 1, 0}};
    return glare_at(std::vector{observer}, job_of(text), options, silent)[0];
}

// For the openings of LM-63's editions the solid angle is that of the body, and the rating is that of the
// scene's closed form or of an emissive body.
TEST(Glare, OfRoundOpenings_IsByTheirShape) {
    const auto file = [](const char* name) {
        return fmt::format("LightSource \"ies\" \"string filename\" \"{}/tests/lights/photometric/{}\"",
                           LUCERNA_SOURCE_DIR, name);
    };
    const V3f ahead(1, 0, 0);
    constexpr double kSampled = 5e-3;  // directions are sampled
    const double d2 = 9 + 1.7 * 1.7, cosine = 1.7 / std::sqrt(d2), sine = 3 / std::sqrt(d2);
    const double face = kPiD / 4 * 0.09;
    // From the lamp's middle, the eye is 3 m to the side and 1.7 m below; the lamp's z points down.
    const V3d eye(3, 0, 1.7);
    const auto round_face = [&](double z) {
        return over_solid_angle(
            eye,
            [z, face](double u, double v) {
                const double r = 0.15 * std::sqrt(u), phi = 2 * kPiD * v;
                return std::pair(V3d(r * std::cos(phi), r * std::sin(phi), z), V3d(0, 0, face));
            },
            kOne);
    };
    const double side = over_solid_angle(
        eye,
        [](double u, double v) {
            const V3d n(std::cos(2 * kPiD * u), std::sin(2 * kPiD * u), 0);
            return std::pair(0.15 * n + V3d(0, 0, 0.1 * (v - 0.5)), 2 * kPiD * 0.15 * 0.1 * n);
        },
        kOne);
    const GlareReport disc = rate_in_room(file("disc95.ies"), 2.9, ahead);
    ASSERT_EQ(disc.sources.size(), 1U);
    EXPECT_NEAR(disc.sources[0].solid_angle / round_face(0), 1, kSampled);
    EXPECT_NEAR(disc.ugr.value, 28.0, 0.1);
    const GlareReport cylinder = rate_in_room(file("cyl95.ies"), 2.9, ahead);
    ASSERT_EQ(cylinder.sources.size(), 1U);
    const double area = face * cosine + 0.3 * 0.1 * sine;
    EXPECT_NEAR(cylinder.sources[0].solid_angle / (round_face(0.05) + side), 1, kSampled);
    EXPECT_NEAR(cylinder.ugr.value, disc.ugr.value - 8 * std::log10(area / (face * cosine)), 0.1);

    const GlareReport sphere = rate_in_room(file("sphere02.ies"), 2, ahead);
    const GlareReport globe = rate_in_room(
        "AreaLightSource \"diffuse\" \"rgb L\" [1414.71 1414.71 1414.71] Shape \"sphere\" \"float radius\" "
        "0.15",
        2, ahead);
    ASSERT_EQ(sphere.sources.size(), 1U);
    EXPECT_NEAR(sphere.sources[0].luminance, 1414.71, 0.1);
    EXPECT_NEAR(sphere.ugr.value, globe.ugr.value, 0.1);
    EXPECT_NEAR(sphere.ugr.value, 22.7, 0.1);
}

GlareReport rate_scene(const std::string& world, GlareOptions options = {}) {
    const Observer observer{"middle", {0, 0, 0}, {0, 0, 1}, {0, 1, 0}};
    Monitor silent;
    options.workers = {2};
    return glare_at(std::vector{observer}, job_of(world), options, silent)[0];
}

GlareOptions with_blur(double blur, double precision = 0.03) {
    GlareOptions options;
    options.blur = blur;
    options.precision = precision;
    return options;
}

// The eye is in a ball of absorbing fog, with the camera and the luminaires outside. L is attenuated along
// the way through the fog, and nothing else in the sum changes.
TEST(Glare, Long_ThroughFog_IsWeakenedOnTheWay) {
    constexpr double kSigma = 0.4, kBall = 1.5;
    const std::string fog = fmt::format(
        "MakeNamedMedium \"fog\" \"string type\" \"homogeneous\" \"rgb sigma_a\" [{0} {0} {0}] \"rgb "
        "sigma_s\" [0 0 0]\nAttributeBegin MediumInterface \"fog\" \"\" Material \"interface\" Shape "
        "\"sphere\" \"float radius\" {1} AttributeEnd\n",
        kSigma, kBall);
    const Disc disc{0.05, 20000, 3, 20};
    const double passes = std::exp(-kSigma * kBall);
    for (const double blur : {0.0, 0.012}) {
        const GlareReport clear = rate_scene(sphere_with({disc}), with_blur(blur)),
                          report = rate_scene(fog + sphere_with({disc}), with_blur(blur));
        ASSERT_EQ(report.sources.size(), 1U);
        const GlareSource &of = report.sources[0], &plain = clear.sources[0];
        EXPECT_NEAR(of.luminance, disc.l * passes, 2e-3 * disc.l);
        EXPECT_NEAR(of.solid_angle, plain.solid_angle, 1e-3 * plain.solid_angle);
        EXPECT_NEAR(of.seen.value, plain.seen.value * sqr(passes), 5e-3 * plain.seen.value);
        // The room's light crosses the fog, often more than once.
        EXPECT_LT(report.background.value, clear.background.value * passes);
    }
}

// The opening of a photometric file is attenuated by fog too.
TEST(Glare, OfAPhotometricFileInFog_IsWeakenedOnTheWay) {
    const testing::TemporaryFolder folder;
    std::ofstream(folder / "lamp.ies")
        << "IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 2 1 1 2 0.3 0.6 0.1\n1 1 9\n0 180\n0\n400 400\n";
    const std::string world =
        "MakeNamedMedium \"fog\" \"string type\" \"homogeneous\" \"rgb sigma_a\" [0.4 0.4 0.4] \"rgb "
        "sigma_s\" [0 0 0]\nAttributeBegin MediumInterface \"fog\" \"\" Material \"interface\" Shape "
        "\"sphere\" \"float radius\" 1 AttributeEnd\n" +
        sphere_with({}) + "Translate 0 0.5 3 LightSource \"ies\" \"string filename\" \"" +
        (folder / "lamp.ies").string() + "\"\n";
    const GlareReport report = rate_scene(world);
    ASSERT_EQ(report.sources.size(), 1U);
    const LuminousOpening box(LuminousOpening::Shape::box, {0.6, 0.3, 0.1});
    double light = 0;
    for (int axis = 0; axis < 3; ++axis) {
        for (const double side : {1.0, -1.0}) {
            const int b = (axis + 1) % 3, c = (axis + 2) % 3;
            light += over_solid_angle(
                V3d(0, -0.5, -3),
                [&](double u, double v) {
                    V3d p, da(0, 0, 0);
                    p[axis] = 0.5 * side * box.size[axis];
                    p[b] = (u - 0.5) * box.size[b], p[c] = (v - 0.5) * box.size[c];
                    da[axis] = side * box.size[b] * box.size[c];
                    return std::pair(p, da);
                },
                [&](const V3d& w) { return 400 / box.projected_area(w); });
        }
    }
    EXPECT_NEAR(report.sources[0].luminance * report.sources[0].solid_angle, light * std::exp(-0.4),
                1e-3 * light);
}

// Returns the reflectance of a clear pane of index 1.5, with all internal reflections.
double thrown_back(double cosine) {
    const double c = std::min(std::fabs(cosine), 1.0), inside = std::sqrt(1 - (1 - sqr(c)) / sqr(1.5));
    const double s = (c - 1.5 * inside) / (c + 1.5 * inside), p = (1.5 * c - inside) / (1.5 * c + inside);
    const double r = (s * s + p * p) / 2;
    return 2 * r / (1 + r);
}

// Returns the background of the room below by brute force. Light paths start at the disc, the pane reflects
// or transmits them, and each wall hit adds what the eye sees of it, through the pane and mirrored in it.
double background_by_light_paths(bool pane) {
    constexpr int kPaths = 400'000;
    const auto in_pane = [](const V3d& at) { return sqr(at.x) + sqr(at.y) < sqr(1.5); };
    Sampler sampler(11, Purpose::test, 0, 0);
    const auto draw = [&sampler] { return double{sampler.next()}; };
    const auto cosine_about = [&](const V3d& n) {
        const double u = draw(), phi = 2 * kPiD * draw();
        const V3d s = (std::fabs(n.x) > 0.7 ? V3d(0, 1, 0) : V3d(1, 0, 0)).cross(n).normalized();
        return s * (std::sqrt(u) * std::cos(phi)) + n.cross(s) * (std::sqrt(u) * std::sin(phi)) +
               n * std::sqrt(1 - u);
    };
    double sum = 0;
    for (int i = 0; i < kPaths; ++i) {
        const double r = 0.1 * std::sqrt(draw()), phi = 2 * kPiD * draw();
        V3d p(r * std::cos(phi), 0.8 + r * std::sin(phi), 2), d = cosine_about({0, 0, -1});
        double power = kPiD * kPiD * 0.01 * 10000 / kPaths;
        for (int bounce = 0; bounce < 16; ++bounce) {
            const double to_pane = (1 - p.z) / d.z;  // infinite or NaN: no hit
            const V3d met = p + to_pane * d;
            if (pane && to_pane > 1e-6 && met.length() < 5 && in_pane(met) && draw() < thrown_back(d.z)) {
                p = met;
                d.z = -d.z;
            }
            const V3d behind = p + (2 - p.z) / d.z * d;
            if ((2 - p.z) / d.z > 1e-6 && sqr(behind.x) + sqr(behind.y - 0.8) < 0.01)
                break;  // back of the disc
            const double b = p.dot(d);
            p += (-b + std::sqrt(sqr(b) - p.dot(p) + 25)) * d;
            power *= 0.5;
            const V3d inwards = -p / 5;
            if (p.z > 0) {
                const bool through = pane && p.z > 1 && in_pane(p / p.z);
                sum += power / kPiD * p.z / 125 * (through ? 1 - thrown_back(p.z / 5) : 1);
            }
            if (const V3d image(p.x, p.y, 2 - p.z); pane && p.z < 1 && in_pane(image / image.z)) {
                const double cosine = image.z / image.length();
                sum += power / kPiD * cosine * (image / image.z - p).normalized().dot(inwards) /
                       image.dot(image) * thrown_back(cosine);
            }
            d = cosine_about(inwards);
        }
    }
    return sum / kPiD;
}

// The light of a luminaire behind a clear pane is attenuated by the pane's transmittance, and still counts as
// the luminaire's, not as background.
TEST(Glare, Long_BehindAPane_IsTheLuminairesStill) {
    const auto world = [](bool pane) {
        return std::string(
                   "AttributeBegin Material \"diffuse\" \"rgb reflectance\" [0.5 0.5 0.5] ReverseOrientation "
                   "Shape \"sphere\" \"float radius\" 5 AttributeEnd\nAttributeBegin Translate 0 0.8 2 "
                   "ReverseOrientation Material \"diffuse\" \"rgb reflectance\" [0 0 0] AreaLightSource "
                   "\"diffuse\" \"rgb L\" [10000 10000 10000] Shape \"disk\" \"float radius\" 0.1 "
                   "AttributeEnd\n") +
               (pane ? "Translate 0 0 1 Material \"thindielectric\" \"float eta\" 1.5 Shape \"disk\" \"float "
                       "radius\" 1.5\n"
                     : "");
    };
    for (const double blur : {0.0, 0.012}) {
        const GlareReport open = rate_scene(world(false), with_blur(blur)),
                          behind = rate_scene(world(true), with_blur(blur));
        ASSERT_EQ(behind.sources.size(), 1U);
        const double through = 1 - thrown_back(1 / std::hypot(1, 0.4));  // 21.8 degrees
        EXPECT_NEAR(open.ugr.value, 37.9, blur > 0 ? 0.25 : 0.05);       // a blur of 12 mm removes 0.2
        EXPECT_NEAR(behind.sources[0].luminance / open.sources[0].luminance, through, 2e-3);
        const double right =
            open.ugr.value + 16 * std::log10(through) -
            8 * std::log10(background_by_light_paths(true) / background_by_light_paths(false));
        EXPECT_NEAR(behind.ugr.value, right, 0.05 + 1.5 * behind.ugr.half_width);
    }
    // Light that the pane reflects onto the wall in front of the eye belongs to the background. With all of
    // the luminaire's light the value would be 17.5.
    const GlareReport exact = rate_scene(world(true), with_blur(0, 0.003));
    EXPECT_NEAR(background_by_light_paths(false), 0.541, 0.003);
    EXPECT_NEAR(exact.background.value, background_by_light_paths(true),
                0.005 + 1.5 * exact.background.half_width);
    EXPECT_LT(exact.background.half_width, 0.05);
}

TEST(Glare, InABlackRoom_IsUndefinedAndNone) {
    const std::string black =
        "Material \"diffuse\" \"rgb reflectance\" [0 0 0] AttributeBegin AreaLightSource \"diffuse\" \"rgb "
        "L\" [9000 9000 9000] Translate 0 0.5 2 Rotate 180 1 0 0 Shape \"disk\" \"float radius\" 0.1 "
        "AttributeEnd Shape \"sphere\" \"float radius\" 5\n";
    const GlareReport report = rate_scene(black);
    ASSERT_EQ(report.sources.size(), 1U);
    EXPECT_EQ(report.background.value, 0);
    EXPECT_TRUE(std::isnan(report.ugr.value));
    EXPECT_TRUE(std::isnan(report.ugr_even.value));
}

// The sky behind the chip is brighter than the filtered chip; pairs of sky and chip samples must not be
// attributed to the chip.
TEST(Glare, BeforeABrightSky_IsOfTheLuminaireAlone) {
    const std::string chip =
        "AttributeBegin Material \"diffuse\" \"rgb reflectance\" [0 0 0] AreaLightSource \"diffuse\" \"rgb "
        "L\" [200000 200000 200000] Translate 0 0.2 1 Rotate 180 1 0 0 Shape \"disk\" \"float radius\" 0.001 "
        "AttributeEnd\n";
    const std::string sky = "LightSource \"infinite\" \"rgb L\" [20000 20000 20000]\n";
    const std::string panel =
        "AttributeBegin Material \"diffuse\" \"rgb reflectance\" [0 0 0] AreaLightSource \"diffuse\" \"rgb "
        "L\" [20000 20000 20000] Translate 0 0 3 Rotate 180 1 0 0 Shape \"disk\" \"float radius\" 3 "
        "AttributeEnd\n";
    GlareOptions options = with_blur(0.012, 0.2);
    options.view_pixels = 64;
    const Reading95 alone = rate_scene(chip, options).sources.at(0).seen;
    for (const std::string& behind : {sky, panel}) {
        const Reading95 seen = rate_scene(chip + behind, options).sources.at(0).seen;
        EXPECT_NEAR(seen.value, alone.value, 2 * std::hypot(seen.half_width, alone.half_width));
        EXPECT_LT(seen.half_width, 0.1 * seen.value);
    }
    // Adjacent chips merge into one source.
    const std::string beside = "Translate 0.003 0 0\n" + chip;
    const Reading95 together = rate_scene(chip + beside, options).sources.at(0).seen;
    EXPECT_GT(together.value, 1.5 * alone.value);
}

// The field of a measured disc smears faint light around it, which does not belong to its luminous area.
class OfAMeasuredDisc : public ::testing::Test {
  protected:
    static constexpr double kR = 0.02, kFlux = 1000, kD = 2, kAbove = 20;
    testing::TemporaryFolder folder;
    std::string world;

    OfAMeasuredDisc() {
        Rig rig;
        rig.views = {17, 17};
        rig.spacing = {0.004, 0.004};
        rig.pixels = {24, 24};
        rig.pixel = {0.02, 0.02};
        rig.distance = 0.1;
        EmitterModel disc = cosine_emitter(EmitterModel::Outline::disc, V2d(kR), kFlux);
        disc.info.unit = FluxUnit::lumen;
        Monitor silent;
        write_light_field(folder / "disc.exr", acquire(disc, rig, Workers{2}, silent));
        world = fmt::format(
            "Material \"diffuse\" \"rgb reflectance\" [{} {} {}] Shape \"sphere\" \"float radius\" {}\n"
            "Translate 0 {} {} Rotate {} 1 0 0 LightSource \"lightfield\" \"string filename\" \"{}\"\n",
            kRho, kRho, kRho, kRadius, kD * std::sin(kAbove * kDegree), kD * std::cos(kAbove * kDegree),
            180 - kAbove, (folder / "disc.exr").string());
    }
};

TEST_F(OfAMeasuredDisc, Long_SolidAngleAndRating_AreTheDiscs) {
    const GlareReport report = rate_scene(world, with_blur(0));
    ASSERT_EQ(report.sources.size(), 1U);
    const double solid_angle = kPiD * sqr(kR / kD), l = kFlux / (sqr(kPiD) * sqr(kR));
    EXPECT_NEAR(report.sources[0].solid_angle, solid_angle, 0.06 * solid_angle);
    EXPECT_NEAR(report.sources[0].luminance, l, 0.06 * l);
    const double p = position_index(0, kAbove);
    const double ugr = 8 * std::log10(0.25 / report.background.value * l * l * solid_angle / (p * p));
    EXPECT_NEAR(report.ugr_even.value, ugr, 0.3);
}

// Tests the intervals of both terms, of the background and of both ratings, over 40 seeds.
TEST_F(OfAMeasuredDisc, Nightly_Intervals_HoldTheTruthAsOftenAsStated) {
    constexpr std::size_t kReadings = 5;
    const auto readings = [&](std::uint64_t seed, int samples, double precision) {
        GlareOptions options = with_blur(0.012, precision);
        options.seed = seed;
        options.samples = samples;
        const GlareReport report = rate_scene(world, options);
        return std::array<Reading95, kReadings>{report.sources.at(0).even, report.sources.at(0).seen,
                                                report.background, report.ugr_even, report.ugr};
    };
    const auto truth = readings(1000, 1 << 20, 0.004);
    constexpr int kRuns = 40;
    std::array<int, kReadings> outside{}, outside_of_a_third{};
    for (std::uint64_t seed = 0; seed < kRuns; ++seed) {
        const auto found = readings(seed, 4096, 0.1);
        for (std::size_t i = 0; i < kReadings; ++i) {
            const double error = std::fabs(found[i].value - truth[i].value);
            outside[i] += error > found[i].half_width;
            outside_of_a_third[i] += error > found[i].half_width / 3;
        }
    }
    for (std::size_t i = 0; i < kReadings; ++i) {
        // With 40 trials of 5 %, more than 7 misses have a probability of 0.1 %.
        EXPECT_LE(outside[i], 7) << i;
        EXPECT_GT(outside_of_a_third[i], 7) << i;
    }
}

TEST(Glare, InWatts_IsRefused) {
    Monitor silent;
    Job job =
        read_scene_text("Camera \"perspective\" Film \"rgb\" WorldBegin\n" + sphere_with({{0.1, 1, 2, 0}}),
                        "scene.pbrt", {}, Workers{2}, silent);
    EXPECT_THROW(
        glare_at(std::vector<Observer>{{"eye", {0, 0, 0}, {0, 0, 1}, {0, 1, 0}}}, std::move(job), {}, silent),
        InputError);
}

}  // namespace glare_test
}  // namespace lucerna

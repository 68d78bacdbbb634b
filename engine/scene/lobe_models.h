// Declares the functions of every lobe in a local frame, for Bsdf, which handles normals and sums. A lobe's
// functions are overloads selected by its type; bsdf_*.cpp has one file per family.
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>

#include "engine/scene/bsdf.h"
#include "engine/scene/lobes.h"
#include "engine/scene/microfacet.h"

namespace lucerna {

// Queries a lobe in the shading frame, mirrored so that the known direction's side of the surface is z > 0.
struct Local {
    V3f wo, wi;                 // relative to ns; wo.z may be <= 0 where the two normals disagree
    bool entering = true;       // wo lies outside (by ng)
    bool transmission = false;  // wi lies on the other side (by ng)
};

struct LocalSample {
    V3f wi;
    Rgb weight;
    float pdf_w = 0;
    bool delta = false;
    bool transmission = false;
    float eta_scale = 1;
    bool straight = false;  // wi is exactly -wo, as if the surface were not there
};
using Draw = std::optional<LocalSample>;

// Rough lobes ignore directions closer to the horizon: the value of a pair of them grows as 1/cos and would
// leave float32's range. They carry almost nothing.
inline constexpr float kGrazingCos = 1e-12F;

inline bool is_smooth(float alpha_x, float alpha_y) {
    return std::max(alpha_x, alpha_y) < kSmoothAlpha;
}

template <typename Rough>
Ggx facets_of(const Rough& lobe) {
    return {std::max(lobe.alpha_x, kLeastAlpha), std::max(lobe.alpha_y, kLeastAlpha)};
}

inline V3f mirrored(const V3f& w) {
    return {-w.x, -w.y, w.z};
}
inline V3f reflected(const V3f& w, const V3f& m) {
    return 2 * w.dot(m) * m - w;
}

// The tolerance allows for rounding of bilinear mixtures of colours in [0,1].
inline bool is_share(const Rgb& c) {
    return std::min({c.x, c.y, c.z}) >= 0 && std::max({c.x, c.y, c.z}) <= 1 + 1e-5F;
}
inline bool is_alpha(float alpha) {
    return alpha >= 0 && std::isfinite(alpha);
}

// The probability of a rough lobe is at least this share of its colour: at facets turned away from the mean
// surface it may carry more than the guess says.
inline constexpr float kLeastChance = 0.1F;

// Only the light must be above the shading horizon of a diffuse surface. If the eye had to be as well,
// silhouettes of smooth meshes would be black.
inline bool is_lit(const Local& at, Transport transport) {
    return (transport == Transport::radiance ? at.wi : at.wo).z >= 0;
}

// Tells whether wo is turned to wi on its own side, and neither is too close to the horizon.
inline bool is_reflection(const Local& at) {
    return !at.transmission && at.wo.z > kGrazingCos && at.wi.z > kGrazingCos;
}

// Each lobe has these functions:
//   value         returns f without the cosine; 0 for a delta
//   density       returns draw()'s density of at.wi, per solid angle; 0 for a delta
//   draw          draws a direction, ignoring `at.wi`
//   albedo_of     returns Bsdf::albedo
//   chance_of     guesses albedo_of's largest channel cheaply, >= 0; positive where value or a delta is
//   is_delta_lobe tells whether it is a delta
//   is_sound      tells whether its parameters are in their ranges

Rgb value(const BlackLobe& lobe, const Local& at, Transport transport);
float density(const BlackLobe& lobe, const Local& at);
Draw draw(const BlackLobe& lobe, const Local& at, const BsdfU& u, Transport transport);
Rgb albedo_of(const BlackLobe& lobe, const Local& at);
float chance_of(const BlackLobe& lobe, const Local& at);
bool is_delta_lobe(const BlackLobe& lobe);
bool is_sound(const BlackLobe& lobe);

Rgb value(const DiffuseLobe& lobe, const Local& at, Transport transport);
float density(const DiffuseLobe& lobe, const Local& at);
Draw draw(const DiffuseLobe& lobe, const Local& at, const BsdfU& u, Transport transport);
Rgb albedo_of(const DiffuseLobe& lobe, const Local& at);
float chance_of(const DiffuseLobe& lobe, const Local& at);
bool is_delta_lobe(const DiffuseLobe& lobe);
bool is_sound(const DiffuseLobe& lobe);

Rgb value(const MirrorLobe& lobe, const Local& at, Transport transport);
float density(const MirrorLobe& lobe, const Local& at);
Draw draw(const MirrorLobe& lobe, const Local& at, const BsdfU& u, Transport transport);
Rgb albedo_of(const MirrorLobe& lobe, const Local& at);
float chance_of(const MirrorLobe& lobe, const Local& at);
bool is_delta_lobe(const MirrorLobe& lobe);
bool is_sound(const MirrorLobe& lobe);

Rgb value(const ConductorLobe& lobe, const Local& at, Transport transport);
float density(const ConductorLobe& lobe, const Local& at);
Draw draw(const ConductorLobe& lobe, const Local& at, const BsdfU& u, Transport transport);
Rgb albedo_of(const ConductorLobe& lobe, const Local& at);
float chance_of(const ConductorLobe& lobe, const Local& at);
bool is_delta_lobe(const ConductorLobe& lobe);
bool is_sound(const ConductorLobe& lobe);

Rgb value(const DielectricLobe& lobe, const Local& at, Transport transport);
float density(const DielectricLobe& lobe, const Local& at);
Draw draw(const DielectricLobe& lobe, const Local& at, const BsdfU& u, Transport transport);
Rgb albedo_of(const DielectricLobe& lobe, const Local& at);
float chance_of(const DielectricLobe& lobe, const Local& at);
bool is_delta_lobe(const DielectricLobe& lobe);
bool is_sound(const DielectricLobe& lobe);

Rgb value(const DiffuseTransmitLobe& lobe, const Local& at, Transport transport);
float density(const DiffuseTransmitLobe& lobe, const Local& at);
Draw draw(const DiffuseTransmitLobe& lobe, const Local& at, const BsdfU& u, Transport transport);
Rgb albedo_of(const DiffuseTransmitLobe& lobe, const Local& at);
float chance_of(const DiffuseTransmitLobe& lobe, const Local& at);
bool is_delta_lobe(const DiffuseTransmitLobe& lobe);
bool is_sound(const DiffuseTransmitLobe& lobe);

Rgb value(const OrenNayarLobe& lobe, const Local& at, Transport transport);
float density(const OrenNayarLobe& lobe, const Local& at);
Draw draw(const OrenNayarLobe& lobe, const Local& at, const BsdfU& u, Transport transport);
Rgb albedo_of(const OrenNayarLobe& lobe, const Local& at);
float chance_of(const OrenNayarLobe& lobe, const Local& at);
bool is_delta_lobe(const OrenNayarLobe& lobe);
bool is_sound(const OrenNayarLobe& lobe);

Rgb value(const GlossLobe& lobe, const Local& at, Transport transport);
float density(const GlossLobe& lobe, const Local& at);
Draw draw(const GlossLobe& lobe, const Local& at, const BsdfU& u, Transport transport);
Rgb albedo_of(const GlossLobe& lobe, const Local& at);
float chance_of(const GlossLobe& lobe, const Local& at);
bool is_delta_lobe(const GlossLobe& lobe);
bool is_sound(const GlossLobe& lobe);

Rgb value(const CoveredDiffuseLobe& lobe, const Local& at, Transport transport);
float density(const CoveredDiffuseLobe& lobe, const Local& at);
Draw draw(const CoveredDiffuseLobe& lobe, const Local& at, const BsdfU& u, Transport transport);
Rgb albedo_of(const CoveredDiffuseLobe& lobe, const Local& at);
float chance_of(const CoveredDiffuseLobe& lobe, const Local& at);
bool is_delta_lobe(const CoveredDiffuseLobe& lobe);
bool is_sound(const CoveredDiffuseLobe& lobe);

Rgb value(const CoatedConductorLobe& lobe, const Local& at, Transport transport);
float density(const CoatedConductorLobe& lobe, const Local& at);
Draw draw(const CoatedConductorLobe& lobe, const Local& at, const BsdfU& u, Transport transport);
Rgb albedo_of(const CoatedConductorLobe& lobe, const Local& at);
float chance_of(const CoatedConductorLobe& lobe, const Local& at);
bool is_delta_lobe(const CoatedConductorLobe& lobe);
bool is_sound(const CoatedConductorLobe& lobe);

Rgb value(const ThinDielectricLobe& lobe, const Local& at, Transport transport);
float density(const ThinDielectricLobe& lobe, const Local& at);
Draw draw(const ThinDielectricLobe& lobe, const Local& at, const BsdfU& u, Transport transport);
Rgb albedo_of(const ThinDielectricLobe& lobe, const Local& at);
float chance_of(const ThinDielectricLobe& lobe, const Local& at);
bool is_delta_lobe(const ThinDielectricLobe& lobe);
bool is_sound(const ThinDielectricLobe& lobe);

Rgb value(const SubstrateBaseLobe& lobe, const Local& at, Transport transport);
float density(const SubstrateBaseLobe& lobe, const Local& at);
Draw draw(const SubstrateBaseLobe& lobe, const Local& at, const BsdfU& u, Transport transport);
Rgb albedo_of(const SubstrateBaseLobe& lobe, const Local& at);
float chance_of(const SubstrateBaseLobe& lobe, const Local& at);
bool is_delta_lobe(const SubstrateBaseLobe& lobe);
bool is_sound(const SubstrateBaseLobe& lobe);
Rgb value(const SubstrateGlossLobe& lobe, const Local& at, Transport transport);
float density(const SubstrateGlossLobe& lobe, const Local& at);
Draw draw(const SubstrateGlossLobe& lobe, const Local& at, const BsdfU& u, Transport transport);
Rgb albedo_of(const SubstrateGlossLobe& lobe, const Local& at);
float chance_of(const SubstrateGlossLobe& lobe, const Local& at);
bool is_delta_lobe(const SubstrateGlossLobe& lobe);
bool is_sound(const SubstrateGlossLobe& lobe);

// These return draw()'s probability of reflection at a smooth boundary, or none where it has no such choice.
std::optional<float> reflect_chance_of(const DielectricLobe& lobe, const Local& at);
std::optional<float> reflect_chance_of(const ThinDielectricLobe& lobe, const Local& at);

// These return the share of the light from -wo that passes on towards wo without being bent.
Rgb straight_share_of(const DielectricLobe& lobe, const Local& at);
Rgb straight_share_of(const ThinDielectricLobe& lobe, const Local& at);

}  // namespace lucerna

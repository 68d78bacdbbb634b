// What the light of a camera sample is made of: by how it came to be seen, and by whose it is.
//
// A path of light is told apart by its end at the eye. Follow it from the eye through mirrors and clear glass
// (perfectly specular scattering alone) to the first place that scatters it otherwise; of a surface that does
// both, as paint under varnish, each path belongs to what it did there.
//
//   emission   there is no such place: the eye sees a lamp or the sky, straight or over mirrors and glass
//   direct     the place is on a surface, and a straight line leads from there to the lamp or the sky
//   caustic    the same, but over one or more mirrors or clear glass, and nothing else
//   indirect   the place is on a surface, and its light came in any other way
//   media      the place is in a medium, which scatters or emits
//
// What media on the way leave of the light changes nothing of what it is. They add up to the image. Gloss,
// however smooth, is not a mirror here, whatever a method's settings take for one: all methods tell parts
// apart alike.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "engine/base/vec.h"
#include "engine/scene/mesh.h"

namespace lucerna {

enum class LightPart : std::uint8_t { emission, direct, indirect, caustic, media };
inline constexpr std::size_t kLightParts = 5;
inline std::string_view light_part_name(LightPart part) {
    constexpr std::string_view names[] = {"emission", "direct", "indirect", "caustic", "media"};
    return names[static_cast<std::size_t>(part)];
}

// Before a group's name, in the names of layers.
inline constexpr const char* kLightGroupPrefix = "lightgroup.";

// Groups of lights: each light is in one. Without names there are none.
struct LightGroups {
    std::vector<std::string> names;
    std::vector<std::uint32_t> of_light;  // index into `names`, of each of the scene's lights
    std::uint32_t of_rest = 0;            // the group of what no light sends: what media emit

    bool empty() const { return names.empty(); }
    std::uint32_t of(std::int32_t light) const {
        return light == kNoLight ? of_rest : of_light[static_cast<std::size_t>(light)];
    }
};

// The parts of one camera sample, radiance or whatever the image counts.
struct LightParts {
    std::array<Rgb, kLightParts> parts;
    std::vector<Rgb> groups;  // as many as `of` has names
    // Of their sum, the light that no sampling of lights can find: what a path that was scattered met at the
    // end of a specular chain, by chance.
    Rgb by_chance;
    std::vector<Rgb> groups_by_chance;  // its shares, by light group
    const LightGroups* of;              // outlives this

    explicit LightParts(const LightGroups& light_groups)
        : groups(light_groups.names.size()), groups_by_chance(groups.size()), of(&light_groups) {
        clear();
    }
    void clear() {
        parts.fill(Rgb(0));
        groups.assign(groups.size(), Rgb(0));
        by_chance = Rgb(0);
        groups_by_chance.assign(groups_by_chance.size(), Rgb(0));
    }
};

// Where whoever follows a path from the eye tells what it finds: beside the radiance that it returns, and
// without a part in it. It knows what has become of the path so far. A value; by default nobody asks.
class PartsSink {
  public:
    PartsSink() = default;
    // Of a path that begins at the eye. Null: nobody asks. Both outlive this. `blur` gets what density
    // estimates at the first place blur, radiance at the eye; what is known of it is that place's alone.
    explicit PartsSink(LightParts* to, Rgb* blur = nullptr) : to_(to), blur_(blur) {}

    explicit operator bool() const { return to_ != nullptr; }
    // What tells lights apart here: all are one where nobody asks for groups.
    std::uint32_t group_of(std::uint32_t light) const {
        return to_ && !to_->groups.empty() ? to_->of->of(static_cast<std::int32_t>(light)) : 0;
    }

    // With the share of what is found that reaches the eye.
    PartsSink times(const Rgb& share) const {
        PartsSink sink = *this;
        if (to_ || blur_) sink.weight_ *= share;
        return sink;
    }
    PartsSink times(float share) const { return times(Rgb(share)); }
    // What the path is after it was scattered: by a perfectly specular lobe, by any other of a surface, in a
    // medium.
    PartsSink past_mirror() const { return on(way_ == Way::lit ? Way::mirrored : way_); }
    PartsSink past_surface() const { return on(way_ == Way::eye ? Way::lit : beyond()); }
    PartsSink in_medium() const { return on(way_ == Way::eye ? Way::in_medium : beyond()); }
    PartsSink past(bool mirror) const { return mirror ? past_mirror() : past_surface(); }

    // A light that the path's last ray meets; kNoLight is whatever no light sends. `by_chance`: no light was
    // sampled for it at the vertex before.
    void met(const Rgb& radiance, std::int32_t light, bool by_chance = false) const {
        constexpr LightPart parts[] = {LightPart::emission, LightPart::direct, LightPart::caustic,
                                       LightPart::indirect, LightPart::media};
        if (to_) add(parts[static_cast<std::size_t>(way_)], radiance, light);
        if (!to_ || !by_chance || way_ == Way::eye) return;
        to_->by_chance += weight_ * radiance;
        if (!to_->groups.empty()) to_->groups_by_chance[to_->of->of(light)] += weight_ * radiance;
    }
    void met(const Rgb& radiance, std::uint32_t light, bool by_chance = false) const {
        met(radiance, static_cast<std::int32_t>(light), by_chance);
    }
    // What is found at the place where the path has arrived, by asking a light in a straight line; and what
    // came there over mirrors and clear glass alone; in any other way.
    void direct(const Rgb& radiance, std::uint32_t light) const { found(LightPart::direct, radiance, light); }
    void caustic(const Rgb& radiance, std::uint32_t light) const {
        found(LightPart::caustic, radiance, light);
    }
    void indirect(const Rgb& radiance, std::uint32_t light) const {
        found(LightPart::indirect, radiance, light);
    }
    // Of an estimate there, what it differs by from a sharper one.
    bool asks_for_blur() const { return blur_ != nullptr; }
    void blurred(const Rgb& difference) const {
        if (blur_) *blur_ += weight_ * difference;
    }
    // What was found there by a sink of its own, all of it in any other way.
    void indirect(const LightParts& found) const {
        if (!to_) return;
        Rgb all(0);
        for (const Rgb& part : found.parts) all += part;
        to_->parts[static_cast<std::size_t>(part_at(LightPart::indirect))] += weight_ * all;
        for (std::size_t i = 0; i < found.groups.size(); ++i) to_->groups[i] += weight_ * found.groups[i];
    }
    // What a medium emits on the way of the path's last ray.
    void glow(const Rgb& radiance) const {
        if (to_)
            add(way_ == Way::eye || way_ == Way::in_medium ? LightPart::media : LightPart::indirect, radiance,
                kNoLight);
    }

  private:
    // In the order of met()'s parts. `in_medium` stays what it is, as `beyond` does.
    enum class Way : std::uint8_t {
        eye,       // from the eye, over mirrors and glass at the most
        lit,       // straight from the first surface that is neither
        mirrored,  // the same, over mirrors and glass
        beyond,    // all that is further
        in_medium  // from where the first place that is neither mirror nor glass was in a medium
    };
    Way beyond() const { return way_ == Way::in_medium ? Way::in_medium : Way::beyond; }
    PartsSink on(Way way) const {
        PartsSink sink = *this;
        sink.way_ = way;
        if (way != Way::eye) sink.blur_ = nullptr;
        return sink;
    }
    void found(LightPart at_first, const Rgb& radiance, std::uint32_t light) const {
        if (to_) add(part_at(at_first), radiance, static_cast<std::int32_t>(light));
    }
    // Of what is found at a place, which is `at_first` if the place is the first of the path.
    LightPart part_at(LightPart at_first) const {
        if (way_ == Way::eye) return at_first;
        return way_ == Way::in_medium ? LightPart::media : LightPart::indirect;
    }
    void add(LightPart part, const Rgb& radiance, std::int32_t light) const {
        const Rgb seen = weight_ * radiance;
        to_->parts[static_cast<std::size_t>(part)] += seen;
        if (!to_->groups.empty()) to_->groups[to_->of->of(light)] += seen;
    }

    LightParts* to_ = nullptr;
    Rgb* blur_ = nullptr;
    Rgb weight_{1.0F};
    Way way_ = Way::eye;
};

}  // namespace lucerna

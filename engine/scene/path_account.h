// Keeps the account of a path from the eye: its throughput, and the layer and light group of its light.
//
// Layers divide the light of an image by the end of its path at the eye. Follow the path from the eye through
// mirrors and clear glass (perfectly specular scattering only) to the first place that scatters it otherwise.
// At a surface that does both, as paint under varnish, each path belongs to the lobe that scattered it.
//
//   emission   there is no such place: the eye sees a lamp or the sky, straight or over mirrors and glass
//   direct     the place is on a surface, and a straight line leads from there to the lamp or the sky
//   caustic    the place is on a surface, and only mirrors or clear glass are between it and the lamp or sky
//   indirect   the place is on a surface, and its light arrives in any other way
//   media      the place is in a medium, which scatters or emits
//
// Media and panes on the way do not change the layer. The layers of a sample add up to its radiance, which is
// defined as their sum. Gloss, however smooth, does not count as a mirror here, whatever a method's settings
// say, so that all methods define layers alike.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "engine/base/vec.h"
#include "engine/colour/rendition.h"
#include "engine/scene/mesh.h"

namespace lucerna {

// An image file has further layers in the wider sense (groups of channels): features and halves of the
// samples.
enum class Layer : std::uint8_t { emission, direct, indirect, caustic, media };
inline constexpr std::size_t kLayers = 5;
inline std::string_view layer_name(Layer layer) {
    constexpr std::string_view names[] = {"emission", "direct", "indirect", "caustic", "media"};
    return names[static_cast<std::size_t>(layer)];
}

// Precedes a group's name in the names of image channels.
inline constexpr const char* kLightGroupPrefix = "lightgroup.";

// Assigns each light to a group. Without names there are no groups.
struct LightGroups {
    std::vector<std::string> names;
    std::vector<std::uint32_t> of_light;  // per light of the scene: index into `names`
    // Has each group's spectral flux per lumen that its lights emit [W/(nm lm)], if the scene is in intervals
    // of wavelengths (WorkingSpace); empty otherwise.
    std::vector<BandSpectrum> spectra = {};
    std::uint32_t of_rest = 0;  // the group of light that no light source sends: emission of media

    bool empty() const { return names.empty(); }
    std::uint32_t of(std::int32_t light) const {
        return light == kNoLight ? of_rest : of_light[static_cast<std::size_t>(light)];
    }
};

// Holds the result of one sample of a pixel or a sensor, in the image's unit.
struct SampleAccount {
    std::array<Rgb, kLayers> layers;
    std::vector<Rgb> groups;  // one for each of the scene's light groups
    // Holds the part of the radiance that light samples do not find: light at the end of a specular chain,
    // which a scattered path met by chance or found by a search for such chains (chain_guide.h).
    // `groups_by_chance` has it by light group.
    Rgb by_chance;
    std::vector<Rgb> groups_by_chance;
    // Holds the difference of density estimates at the visible place from sharper ones
    // (DensityEstimateResult). It is estimated only if `wants_blur`.
    Rgb blur;
    bool wants_blur = false;
    const LightGroups* light_groups;  // outlives this account; null: no groups

    explicit SampleAccount(const LightGroups* of_scene = nullptr)
        : groups(of_scene ? of_scene->names.size() : 0),
          groups_by_chance(groups.size()),
          light_groups(of_scene) {
        clear();
    }
    void clear() {
        layers.fill(Rgb(0));
        groups.assign(groups.size(), Rgb(0));
        by_chance = blur = Rgb(0);
        groups_by_chance.assign(groups_by_chance.size(), Rgb(0));
    }
    Rgb radiance() const { return layers[0] + layers[1] + layers[2] + layers[3] + layers[4]; }
    // Adds `share` times the contents of another account of the same scene.
    void add(const SampleAccount& other, float share = 1) {
        for (std::size_t i = 0; i < kLayers; ++i) layers[i] += share * other.layers[i];
        for (std::size_t i = 0; i < groups.size(); ++i) {
            groups[i] += share * other.groups[i];
            groups_by_chance[i] += share * other.groups_by_chance[i];
        }
        by_chance += share * other.by_chance;
        blur += share * other.blur;
    }
};

// Represents the end of a path from the eye: throughput, scattering events so far, and account of the sample.
// All radiance reaches an image through the functions add_…() here, which multiply it by the throughput,
// except where they say otherwise.
class PathAccount {
  public:
    // Begins a path at the eye. `to` must outlive it.
    explicit PathAccount(SampleAccount& to, const Rgb& throughput_at_eye = Rgb(1.0F))
        : throughput(throughput_at_eye), to_(&to) {}

    Rgb throughput;

    PathAccount times(const Rgb& share) const {
        PathAccount scaled = *this;
        scaled.throughput *= share;
        return scaled;
    }
    PathAccount times(float share) const { return times(Rgb(share)); }
    // Makes all further light go to another account.
    void use_account(SampleAccount& account) { to_ = &account; }
    // Returns an empty account with the same groups, for light that may turn out not to count.
    SampleAccount scratch() const { return SampleAccount(to_->light_groups); }
    // Books the contents of a scratch account of this path, without multiplying by the throughput.
    void add_account(const SampleAccount& found, float share = 1) const { to_->add(found, share); }

    // Records that the path was scattered by a perfectly specular or any other lobe of a surface, or in a
    // medium.
    void scatter_at_surface(bool specular) {
        if (!specular) {
            way_ = way_ == Way::eye ? Way::lit : beyond();
        } else if (way_ == Way::lit) {
            way_ = Way::mirrored;
        }
    }
    void scatter_in_medium() { way_ = way_ == Way::eye ? Way::in_medium : beyond(); }

    // Books a light that the path's ray meets; kNoLight stands for emission of media. `by_chance` says that
    // no light was sampled for it at the previous vertex.
    void add_emitted(const Rgb& radiance, std::int32_t light, bool by_chance = false) const {
        constexpr Layer layers[] = {Layer::emission, Layer::direct, Layer::caustic, Layer::indirect,
                                    Layer::media};
        add(layers[static_cast<std::size_t>(way_)], radiance, light);
        if (!by_chance || way_ == Way::eye) return;
        to_->by_chance += throughput * radiance;
        if (!to_->groups.empty())
            to_->groups_by_chance[to_->light_groups->of(light)] += throughput * radiance;
    }
    void add_emitted(const Rgb& radiance, std::uint32_t light, bool by_chance = false) const {
        add_emitted(radiance, static_cast<std::int32_t>(light), by_chance);
    }
    // These two book light found at the place where the path has arrived: add_direct() from a light in a
    // straight line, add_indirect() in any way except over mirrors and clear glass alone.
    void add_direct(const Rgb& radiance, std::uint32_t light) const {
        add_here(Layer::direct, radiance, light);
    }
    void add_indirect(const Rgb& radiance, std::uint32_t light) const {
        add_here(Layer::indirect, radiance, light);
    }
    // These two book such light of many lights in two steps. Its layer is `at_first` at the path's first
    // place.
    void add_to_layer(Layer at_first, const Rgb& radiance) const {
        to_->layers[static_cast<std::size_t>(layer_here(at_first))] += throughput * radiance;
    }
    void add_to_group(const Rgb& radiance, std::uint32_t light) const {
        to_->groups[group_of(light)] += throughput * radiance;
    }
    // Books the emission of a medium along the path's ray; `arriving` includes the throughput.
    void add_medium_emission(const Rgb& arriving) const {
        const bool seen = way_ == Way::eye || way_ == Way::in_medium;
        add_arriving(seen ? Layer::media : Layer::indirect, arriving, kNoLight);
    }
    // Books the difference of a density estimate at the first place from a sharper one.
    void add_blur(const Rgb& difference) const { to_->blur += throughput * difference; }

    bool wants_blur() const { return to_->wants_blur && way_ == Way::eye; }
    // Tells whether caustics here belong to a layer of their own.
    bool separates_caustics() const { return way_ == Way::eye; }
    bool has_groups() const { return !to_->groups.empty(); }
    std::uint32_t group_of(std::uint32_t light) const {
        return has_groups() ? to_->light_groups->of(static_cast<std::int32_t>(light)) : 0;
    }

  private:
    // The states are in the order of add_emitted()'s layers. `in_medium` and `beyond` are final.
    enum class Way : std::uint8_t {
        eye,       // from the eye, over mirrors and glass at most
        lit,       // in a straight line from the first surface that is neither
        mirrored,  // from that surface over mirrors and glass
        beyond,    // anything further
        in_medium  // beyond a first place in a medium
    };
    Way beyond() const { return way_ == Way::in_medium ? Way::in_medium : Way::beyond; }
    Layer layer_here(Layer at_first) const {
        if (way_ == Way::eye) return at_first;
        return way_ == Way::in_medium ? Layer::media : Layer::indirect;
    }
    void add_here(Layer at_first, const Rgb& radiance, std::uint32_t light) const {
        add(layer_here(at_first), radiance, static_cast<std::int32_t>(light));
    }
    void add(Layer layer, const Rgb& radiance, std::int32_t light) const {
        add_arriving(layer, throughput * radiance, light);
    }
    // `arriving` includes the throughput.
    void add_arriving(Layer layer, const Rgb& arriving, std::int32_t light) const {
        to_->layers[static_cast<std::size_t>(layer)] += arriving;
        if (!to_->groups.empty()) to_->groups[to_->light_groups->of(light)] += arriving;
    }

    SampleAccount* to_;
    Way way_ = Way::eye;
};

}  // namespace lucerna

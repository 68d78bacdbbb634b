// Builds the scene text and files of the bombs.
#pragma once

#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>
#include <vector>

#include "tests/bombs/bomb.h"

namespace lucerna::testing {

inline void write(const std::filesystem::path& file, std::string_view text) {
    std::ofstream(file, std::ios::binary).write(text.data(), static_cast<std::streamsize>(text.size()));
}

inline std::string repeated(std::string_view text, std::size_t times) {
    std::string all;
    all.reserve(text.size() * times);
    for (std::size_t i = 0; i < times; ++i) all += text;
    return all;
}

// Returns a scene of so few pixels that only the reader does any work. The world begins on line 3.
inline std::string scene(std::string_view world) {
    return "Camera \"perspective\"\nFilm \"rgb\" \"integer xresolution\" 4 \"integer yresolution\" "
           "4\nWorldBegin\n" +
           std::string(world) + "\nLightSource \"infinite\"\n";
}
inline const std::vector<std::string> kRender{"render", "scene.pbrt", "-o", "image.exr", "--spp",
                                              "1",      "--threads",  "2",  "--quiet"};

// Returns a bomb that renders a scene of the given text.
inline Bomb of_scene(std::string name, std::string text, std::vector<std::string> mentions,
                     Bomb::End end = Bomb::End::refused) {
    return {
        std::move(name),
        [text = std::move(text)](const std::filesystem::path& folder) { write(folder / "scene.pbrt", text); },
        kRender, std::move(mentions), end};
}

template <typename Number>
void append(std::string& bytes, Number number) {  // little-endian, like this machine
    char raw[sizeof number];
    std::memcpy(raw, &number, sizeof number);
    bytes.append(raw, sizeof raw);
}

}  // namespace lucerna::testing

// All that `lucerna compare` finds out about one or several images and their reference, before it is written
// anywhere.
#pragma once

#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "engine/base/monitor.h"
#include "engine/base/parallel.h"
#include "engine/evaluation/compare.h"
#include "engine/evaluation/flip.h"
#include "engine/evaluation/seeds.h"
#include "engine/image/image.h"

namespace lucerna {

struct ComparisonSettings {
    double mask_above = std::numeric_limits<double>::infinity();  // compare.h
    int z_cell = 1;  // pixels along the side of what the z-test takes for one value
    bool flip = true;
    double pixels_per_degree = kUsualPixelsPerDegree;
    std::optional<double>
        exposure;  // stops, of what is shown and of FLIP's picture; none: from the reference
    Workers workers;
};

// Over the pixels that are compared, and over the images.
struct FlipNumbers {
    double mean = 0, largest = 0;
    std::vector<double> each;  // mean per image
    Image map;                 // one channel, "flip", the mean of the images' maps
};

struct ImageNumbers {
    std::string name;
    double mse = 0, relative_mse = 0, mape = 0, error = 0;
};

// What there is to look at; pixels that are not compared are alike in all of them.
struct ComparedPictures {
    Image first, mean, reference;  // radiance, R G B; first is the first of the images
    Image error;                   // of the mean: relative_error() of error_pictures.h
    std::optional<Image> noise;  // standard deviation between two images or more, relative_to() the reference
};

struct ComparisonReport {
    std::string reference;
    std::vector<ImageNumbers> images;
    std::string unit,
        reference_unit;  // "lucerna.unit" of the first image and of the reference; empty: not stated
    // Of the image, or of the mean of the images, but for mse, relative_mse, mape and error: these are of one
    // image, on the average over them.
    Comparison numbers;
    std::optional<BiasAndNoise> seeds;  // of two images or more
    double pixels_per_degree = 0;
    double exposure = 1;              // factor
    std::optional<FlipNumbers> flip;  // of pictures at that exposure, as --png shows them
    std::optional<FlipNumbers> hdr_flip;
    std::optional<ExposureRange> exposures;  // of hdr_flip
    ComparedPictures pictures;
};

// Throws InputError, naming the file, where images do not compare. `images`: at least one.
ComparisonReport compare_images(const std::vector<NamedImage>& images, const NamedImage& reference,
                                const ComparisonSettings& settings, Monitor& monitor);

// For people and for programs. `text` ends in a newline; so does the JSON.
std::string comparison_text(const ComparisonReport& report);
std::string comparison_json(const ComparisonReport& report);

}  // namespace lucerna

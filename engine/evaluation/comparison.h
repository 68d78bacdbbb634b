// The results of `lucerna compare` for one or several images and a reference, before any output.
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
    int z_cell = 1;  // pixels along the side of a cell of the z-test
    bool flip = true;
    double pixels_per_degree = kUsualPixelsPerDegree;
    std::optional<double> exposure;  // stops, of pictures and of FLIP; none: from the reference
    Workers workers;
};

// FLIP over the compared pixels and over the images.
struct FlipNumbers {
    double mean = 0, largest = 0;
    std::vector<double> each;  // mean per image
    Image map;                 // one channel, "flip", the mean of the images' maps
};

struct ImageNumbers {
    std::string name;
    double mse = 0, relative_mse = 0, mape = 0, error = 0;
};

// Images for display; pixels that are not compared are equal in all of them.
struct ComparedPictures {
    Image first, mean, reference;  // radiance in R G B; `first` is the first of the images
    Image error;                   // of the mean: relative_error() of error_pictures.h
    std::optional<Image> noise;    // standard deviation, relative_to() the reference; none for one image
};

struct ComparisonReport {
    std::string reference;
    std::vector<ImageNumbers> images;
    std::string unit,
        reference_unit;  // of the first image and of the reference ("lucerna.unit"); empty if not stated
    // Numbers of the image or of the mean image, except that mse, relative_mse, mape and error are averages
    // over the images.
    Comparison numbers;
    std::optional<BiasAndNoise> seeds;  // set for two images or more
    double pixels_per_degree = 0;
    double exposure = 1;              // factor
    std::optional<FlipNumbers> flip;  // of pictures at that exposure, as --png shows them
    std::optional<FlipNumbers> hdr_flip;
    std::optional<ExposureRange> exposures;  // of hdr_flip
    ComparedPictures pictures;
};

// Compares at least one image. Throws InputError, naming the file, if images cannot be compared.
ComparisonReport compare_images(const std::vector<NamedImage>& images, const NamedImage& reference,
                                const ComparisonSettings& settings, Monitor& monitor);

// Format the report as text and as JSON; both end in a newline.
std::string comparison_text(const ComparisonReport& report);
std::string comparison_json(const ComparisonReport& report);

}  // namespace lucerna

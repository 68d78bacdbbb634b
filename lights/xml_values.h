// Numbers in the XML of photometric formats.
#pragma once

#include <string>
#include <string_view>

#include "engine/base/error.h"
#include "engine/text/plain_text.h"
#include "engine/text/xml.h"
#include "lights/photometric_files.h"

namespace lucerna {

// Returns the number within the limits, or throws InputError at the element's line. `what` names it.
inline double xml_number(std::string_view text, const XmlElement& element, const std::string& file,
                         std::string_view what, double least, double most) {
    const auto value = number_of(trimmed(text));
    const Location place{file, element.line, 1};
    if (!value) input_error(place, "{} is \"{}\"; expected a number", what, shown_value(text));
    if (!(*value >= least && *value <= most))
        input_error(place, "{} is {:g}; expected {:g} to {:g}", what, *value, least, most);
    return *value;
}

// Returns the number in a child as xml_number() does, or `missing` if there is no such child.
inline double xml_child(const XmlElement& parent, std::string_view name, const std::string& file,
                        double least, double most, double missing) {
    const XmlElement* child = parent.child(name);
    return child ? xml_number(child->text, *child, file, name, least, most) : missing;
}

// Returns the number in an attribute as xml_number() does, and throws InputError if it is missing.
inline double xml_attribute(const XmlElement& element, std::string_view name, const std::string& file,
                            double least, double most) {
    const std::string* value = element.attribute(name);
    if (value) return xml_number(*value, element, file, name, least, most);
    input_error({file, element.line, 1}, "<{}> lacks the attribute \"{}\"", element.name, name);
}

}  // namespace lucerna

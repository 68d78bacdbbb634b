#include "engine/figures/markup.h"

#include <vector>

#include "engine/text/plain_text.h"

namespace lucerna {
namespace {

std::string base64(const std::vector<unsigned char>& bytes) {
    constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text;
    text.reserve((bytes.size() + 2) / 3 * 4);
    for (std::size_t i = 0; i < bytes.size(); i += 3) {
        const std::size_t there = std::min<std::size_t>(3, bytes.size() - i);
        unsigned triple = 0;
        for (std::size_t k = 0; k < 3; ++k) triple = triple << 8U | (k < there ? bytes[i + k] : 0U);
        for (std::size_t k = 0; k < 4; ++k) text += k <= there ? kDigits[triple >> (18 - 6 * k) & 63U] : '=';
    }
    return text;
}

}  // namespace

std::string markdown(std::string_view text) {
    std::string escaped;
    for (const char c : text) {
        if (std::string_view("\\`*_[]<>|#~$").find(c) != std::string_view::npos) escaped += '\\';
        escaped += c;
    }
    return escaped;
}

std::string html_text(std::string_view text) {
    std::string result;
    for (const char c : text) {
        switch (c) {
            case '&':
                result += "&amp;";
                break;
            case '<':
                result += "&lt;";
                break;
            case '>':
                result += "&gt;";
                break;
            case '"':
                result += "&quot;";
                break;
            case '\'':
                result += "&#39;";
                break;
            default:
                result += c;
        }
    }
    return result;
}

std::string svg_text(std::string_view text) {
    return html_text(plain_text(one_line(text)));
}

std::string data_url(const Image& picture) {
    return "data:image/png;base64," + base64(png_bytes(picture));
}

}  // namespace lucerna

#include "cli/report_markup.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>

namespace cli {

namespace {

constexpr std::string_view kReplacement = "\xEF\xBF\xBD";

/// Bytes of the UTF-8 character at the front of `text`; 0 where there is none (overlong forms, surrogates and
/// values beyond U+10FFFF included).
std::size_t character_size(std::string_view text) {
    const auto byte = [&](std::size_t i) {
        return i < text.size() ? static_cast<unsigned char>(text[i]) : 0u;
    };
    const auto continues = [&](std::size_t i) { return (byte(i) & 0xC0u) == 0x80u; };
    const unsigned first = byte(0);
    if (first < 0x80) return 1;
    if (first >= 0xC2 && first <= 0xDF) return continues(1) ? 2 : 0;
    if (first >= 0xE0 && first <= 0xEF) {
        const bool overlong = first == 0xE0 && byte(1) < 0xA0, surrogate = first == 0xED && byte(1) > 0x9F;
        return continues(1) && continues(2) && !overlong && !surrogate ? 3 : 0;
    }
    if (first >= 0xF0 && first <= 0xF4) {
        const bool overlong = first == 0xF0 && byte(1) < 0x90, beyond = first == 0xF4 && byte(1) > 0x8F;
        return continues(1) && continues(2) && continues(3) && !overlong && !beyond ? 4 : 0;
    }
    return 0;
}

void append_escaped(std::string& html, std::string_view character) {
    switch (character[0]) {
        case '&':
            html += "&amp;";
            return;
        case '<':
            html += "&lt;";
            return;
        case '>':
            html += "&gt;";
            return;
        case '"':
            html += "&quot;";
            return;
        case '\'':
            html += "&#39;";
            return;
        default:
            break;
    }
    const auto code = static_cast<unsigned char>(character[0]);
    const bool control = (code < 0x20 && code != '\t' && code != '\n') || code == 0x7F ||
                         (code == 0xC2 && static_cast<unsigned char>(character[1]) < 0xA0);
    html += control ? kReplacement : character;
}

std::string power_of_ten(double value) {
    constexpr std::array<const char*, 10> kSuperscripts = {"⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"};
    const std::string text = fmt::format("{:.2e}", value);
    const std::size_t exponent = text.find('e');
    std::string power = text[exponent + 1] == '-' ? "⁻" : "";
    for (const char digit : std::to_string(std::abs(std::stoi(text.substr(exponent + 1)))))
        power += kSuperscripts[static_cast<std::size_t>(digit - '0')];
    std::string mantissa = text.substr(0, exponent);
    if (mantissa[0] == '-') mantissa = fmt::format("−{}", mantissa.substr(1));
    return fmt::format("{}\u202F×\u202F10{}", mantissa, power);
}

std::string with_thousands(std::string digits) {
    for (std::size_t at = digits.size(); at > 3;) {
        at -= 3;
        digits.insert(at, 1, ',');
    }
    return digits;
}

/// Where the digits after the point begin, point included; size() where there are none. Npos for what is not
/// a plain number.
std::size_t fraction_begin(const std::string& value) {
    if (value.find_first_not_of("0123456789,.") != std::string::npos) {
        if (value.rfind("−", 0) != 0) return std::string::npos;
        const std::size_t sign = std::string_view("−").size();
        const std::size_t found = fraction_begin(value.substr(sign));
        return found == std::string::npos ? found : found + sign;
    }
    return std::min(value.find('.'), value.size());
}

std::string aligned(const std::string& value, std::size_t fraction_width) {
    const std::size_t begin = fraction_begin(value);
    if (fraction_width == 0 || begin == std::string::npos) return value;
    return fmt::format("{}<span class=\"fraction\" style=\"width:{}ch\">{}</span>", value.substr(0, begin),
                       fraction_width, value.substr(begin));
}

std::string cell_html(const Cell& cell, const Column& column, std::size_t fraction_width, bool heads_row) {
    std::string classes = column.text ? "text" : "number";
    if (cell.strong) classes += " best";
    if (cell.quiet) classes += " quiet";
    if (cell.wrap) classes += " wrap";
    const char* tag = heads_row ? "th" : "td";
    std::string html =
        fmt::format("<{} class=\"{}\"{}{}>", tag, classes, heads_row ? " scope=\"row\"" : "",
                    cell.note.empty() ? std::string() : fmt::format(" title=\"{}\"", cell.note));
    html += column.text ? cell.value : aligned(cell.value, fraction_width);
    if (!cell.interval.empty()) html += fmt::format("<small>{}</small>", cell.interval);
    return html + fmt::format("</{}>", tag);
}

}  // namespace

std::string escape_html(std::string_view text) {
    std::string html;
    html.reserve(text.size() + text.size() / 8);
    while (!text.empty()) {
        const std::size_t size = character_size(text);
        if (size == 0) {
            html += kReplacement;
        } else {
            append_escaped(html, text.substr(0, size));
        }
        text.remove_prefix(std::max<std::size_t>(size, 1));
    }
    return html;
}

std::string shortened(std::string_view text, std::size_t length) {
    assert(length > 0);
    std::size_t at = 0, last_but_one = 0;
    for (std::size_t count = 0; at < text.size(); ++count) {
        if (count == length) return std::string(text.substr(0, last_but_one)) + "…";
        if (count == length - 1) last_but_one = at;
        at += std::max<std::size_t>(character_size(text.substr(at)), 1);
    }
    return std::string(text);
}

int decimals_of(double value, int digits) {
    if (value == 0.0 || !std::isfinite(value)) return 0;
    // Rounding may carry into another digit: 0.9996 has three digits as 1.00.
    const std::string rounded = fmt::format("{:.{}e}", std::abs(value), digits - 1);
    return std::clamp(digits - 1 - std::stoi(rounded.substr(rounded.find('e') + 1)), 0, 6);
}

std::string fixed(double value, int decimals) {
    if (std::isnan(value)) return "–";
    if (std::isinf(value)) return value > 0.0 ? "∞" : "−∞";
    const double magnitude = std::abs(value);
    const bool lost = magnitude > 0.0 && decimals >= 6 && magnitude < 0.5e-4;
    if (lost || magnitude >= 1e15) return power_of_ten(value);
    std::string text = fmt::format("{:.{}f}", magnitude, decimals);
    const bool zero = text.find_first_not_of("0.") == std::string::npos;
    const std::size_t point = std::min(text.find('.'), text.size());
    text = with_thousands(text.substr(0, point)) + text.substr(point);
    return value < 0.0 && !zero ? fmt::format("−{}", text) : text;
}

std::string significant(double value) {
    return fixed(value, decimals_of(value, 3));
}

std::string trimmed(double value) {
    std::string text = significant(value);
    if (text.find('.') == std::string::npos || fraction_begin(text) == std::string::npos) return text;
    text.erase(text.find_last_not_of('0') + 1);
    if (text.back() == '.') text.pop_back();
    return text;
}

std::string grouped(std::uint64_t value) {
    return with_thousands(std::to_string(value));
}

Cell number_cell(double value) {
    return {.value = significant(value)};
}

Cell seconds_cell(double seconds) {
    if (seconds > 0.0 && seconds < 0.0005) return {.value = "&lt; 0.001"};
    return {.value = fixed(seconds, std::min(decimals_of(seconds, 3), 3))};
}

Cell estimate_cell(const Estimate& estimate, double scale) {
    const double value = estimate.value * scale;
    // A value of 0 says nothing about the decimals; its interval does.
    const int decimals = decimals_of(value == 0.0 ? estimate.high * scale : value, 3);
    Cell cell{.value = fixed(value, decimals)};
    if (std::isfinite(estimate.low) || std::isfinite(estimate.high)) {
        cell.interval = fmt::format("{} – {}", fixed(estimate.low * scale, decimals),
                                    fixed(estimate.high * scale, decimals));
    }
    return cell;
}

std::string table(std::string_view note_html, const std::vector<Column>& columns,
                  const std::vector<std::vector<Cell>>& rows, bool groups) {
    std::vector<std::size_t> fraction_widths(columns.size(), 0);
    for (const std::vector<Cell>& row : rows) {
        assert(row.size() == columns.size());
        for (std::size_t i = 0; i < row.size(); ++i) {
            const std::size_t begin = fraction_begin(row[i].value);
            if (columns[i].text || begin == std::string::npos) continue;
            fraction_widths[i] = std::max(fraction_widths[i], row[i].value.size() - begin);
        }
    }
    const bool units =
        std::any_of(columns.begin(), columns.end(), [](const Column& c) { return !c.unit.empty(); });
    std::string html = fmt::format("<div class=\"scroll\"><table{}>\n", groups ? " class=\"grouped\"" : "");
    html += "<thead><tr>";
    for (const Column& column : columns) {
        html += fmt::format(
            "<th scope=\"col\" class=\"{}\"{}>{}{}</th>", column.text ? "text" : "number",
            column.definition.empty() ? std::string()
                                      : fmt::format(" title=\"{}\"", escape_html(column.definition)),
            escape_html(column.header),
            units
                ? fmt::format("<small>{}</small>", column.unit.empty() ? "&#160;" : escape_html(column.unit))
                : "");
    }
    html += "</tr></thead>\n<tbody>\n";
    for (const std::vector<Cell>& row : rows) {
        html += groups && !row.front().value.empty() ? "<tr class=\"group\">" : "<tr>";
        for (std::size_t i = 0; i < row.size(); ++i)
            html += cell_html(row[i], columns[i], fraction_widths[i], i == 0);
        html += "</tr>\n";
    }
    html += "</tbody></table></div>\n";
    // Not a <caption>: it would be as wide as the table and scroll with it.
    if (!note_html.empty()) html += fmt::format("<p class=\"note under\">{}</p>\n", note_html);
    return html;
}

}  // namespace cli

// core/scene/warning_list.h: warnings about a file, each once, and not without end.
#pragma once

#include <cstddef>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace core {

/// Collects warnings in the order in which they first come. A damaged file may give cause for one in every
/// line, so those beyond kMost are summed up in a last one.
class WarningList {
public:
    static constexpr std::size_t kMost = 50;

    void add(std::string warning) {
        if (seen_.size() == kMost) {
            ++left_out_;
        } else if (const auto [entry, is_new] = seen_.insert(std::move(warning)); is_new) {
            warnings_.push_back(*entry);
        }
    }

    std::vector<std::string> all() const {
        std::vector<std::string> result = warnings_;
        if (left_out_ > 0) result.push_back("and " + std::to_string(left_out_) + " more warnings");
        return result;
    }

private:
    std::set<std::string> seen_;
    std::vector<std::string> warnings_;
    std::size_t left_out_ = 0;
};

}  // namespace core

#include "sdf/vdb_scan.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstring>
#include <limits>
#include <optional>
#include <set>
#include <string_view>
#include <vector>

#include "core/support/error.h"

namespace sdf {

namespace {

constexpr std::uint64_t kMagic = 0x56444220;
constexpr std::uint32_t kOldestVersion = 222;
constexpr std::uint32_t kNewestVersion = 224;

/// What the grids of a file may take: a node of the upper level holds 32,768 values, written as a few
/// thousand bytes where they are all alike.
constexpr std::uint64_t kMemoryAllowance = std::uint64_t{256} << 20;
constexpr std::uint64_t kMemoryPerFileByte = 128;

/// Beyond this, corners of boxes leave the range of 32 bits.
constexpr std::int32_t kFarthestTile = 1 << 30;

/// Samples along a side of a leaf, of a lower and of an upper node, as powers of two.
constexpr int kLeafLog2 = 3, kLowerLog2 = 4, kUpperLog2 = 5;
constexpr std::int32_t kUpperSide = 1 << (kLeafLog2 + kLowerLog2 + kUpperLog2);
constexpr std::size_t kLeafMaskBytes = 64, kLowerMaskBytes = 512, kUpperMaskBytes = 4096;

enum Compression : std::uint32_t { kZip = 1, kActiveMask = 2, kBlosc = 4 };

constexpr std::size_t kBloscHeaderBytes = 16;
constexpr std::uint64_t kLeastListBytes = 128;

enum class LeafKind : std::uint8_t { kValues, kBits, kMask };

/// A type of tree: bytes of a value, and of one stored as half.
struct TreeType {
    std::string_view name;
    std::size_t value_bytes;
    std::size_t half_bytes;
    LeafKind leaf;
};
constexpr TreeType kTreeTypes[] = {
    {"Tree_float_5_4_3", 4, 2, LeafKind::kValues},   {"Tree_double_5_4_3", 8, 2, LeafKind::kValues},
    {"Tree_vec3s_5_4_3", 12, 6, LeafKind::kValues},  {"Tree_vec3d_5_4_3", 24, 6, LeafKind::kValues},
    {"Tree_vec3i_5_4_3", 12, 12, LeafKind::kValues}, {"Tree_int32_5_4_3", 4, 4, LeafKind::kValues},
    {"Tree_int64_5_4_3", 8, 8, LeafKind::kValues},   {"Tree_bool_5_4_3", 1, 1, LeafKind::kBits},
    {"Tree_mask_5_4_3", 1, 1, LeafKind::kMask},
};
constexpr std::string_view kHalfSuffix = "_HalfFloat";

/// Names with the number of bytes that follow them, whatever the file claims.
struct FixedSize {
    std::string_view name;
    std::size_t bytes;
};
constexpr FixedSize kMetadataTypes[] = {{"bool", 1},   {"int32", 4},  {"int64", 8},  {"float", 4},
                                        {"double", 8}, {"vec2i", 8},  {"vec2s", 8},  {"vec2d", 16},
                                        {"vec3i", 12}, {"vec3s", 12}, {"vec3d", 24}, {"vec4i", 16},
                                        {"vec4s", 16}, {"vec4d", 32}, {"mat4s", 64}, {"mat4d", 128}};
constexpr FixedSize kMaps[] = {{"AffineMap", 128},
                               {"UnitaryMap", 128},
                               {"ScaleMap", 120},
                               {"UniformScaleMap", 120},
                               {"TranslationMap", 24},
                               {"ScaleTranslateMap", 144},
                               {"UniformScaleTranslateMap", 144}};

template <std::size_t N>
std::optional<std::size_t> fixed_size(const FixedSize (&table)[N], std::string_view name) {
    const auto* found = std::find_if(std::begin(table), std::end(table),
                                     [&](const FixedSize& entry) { return entry.name == name; });
    return found == std::end(table) ? std::nullopt : std::optional(found->bytes);
}

using Bytes = std::span<const std::uint8_t>;

template <typename T>
T load(Bytes bytes) {
    static_assert(std::endian::native == std::endian::little);
    T value{};
    std::memcpy(&value, bytes.data(), sizeof(T));
    return value;
}

std::size_t count_bits(Bytes mask) {
    std::size_t count = 0;
    for (const std::uint8_t byte : mask) count += static_cast<std::size_t>(std::popcount(byte));
    return count;
}

bool is_on(Bytes mask, std::size_t bit) {
    return (mask[bit / 8] >> (bit % 8)) & 1;
}

struct Coordinate {
    std::int32_t x = 0, y = 0, z = 0;

    auto operator<=>(const Coordinate&) const = default;
};

/// The corner of a node's child; z runs fastest.
Coordinate child_corner(const Coordinate& corner, std::size_t index, int log2, std::int32_t child_side) {
    const auto mask = (std::size_t{1} << log2) - 1;
    return {corner.x + static_cast<std::int32_t>(index >> (2 * log2)) * child_side,
            corner.y + static_cast<std::int32_t>((index >> log2) & mask) * child_side,
            corner.z + static_cast<std::int32_t>(index & mask) * child_side};
}

class Scanner {
public:
    Scanner(Bytes bytes, const std::string& name)
        : bytes_(bytes),
          name_(name),
          memory_left_(kMemoryAllowance + kMemoryPerFileByte * static_cast<std::uint64_t>(bytes.size())) {}

    void scan() {
        if (bytes_.size() < 8 || read<std::uint64_t>() != kMagic) {
            fail("it does not start with the magic number");
        }
        const auto version = read<std::uint32_t>();
        if (version < kOldestVersion || version > kNewestVersion) {
            fail(fmt::format("its format is {}; {} to {} are read", version, kOldestVersion, kNewestVersion));
        }
        take(8);  // The version of the library.
        const bool has_offsets = read<std::uint8_t>() != 0;
        take(36);  // A random identity.
        scan_metadata();
        const auto grid_count = read<std::int32_t>();
        if (grid_count < 0) fail(fmt::format("it has {} grids", grid_count));
        for (std::int32_t i = 0; i < grid_count; ++i) {
            element_ = fmt::format("grid {}: ", i);
            scan_grid(has_offsets);
        }
    }

private:
    struct Leaf {
        Coordinate corner;
        Bytes mask;
    };

    [[noreturn]] void fail(const std::string& message) const {
        throw core::InputError(core::ErrorKind::kBadData,
                               fmt::format("'{}': not a whole .vdb file ({}{})", name_, element_, message));
    }

    Bytes take(std::uint64_t count) {
        if (count > bytes_.size() - position_) {
            fail(fmt::format("{} bytes are wanted at byte {} of {}", count, position_, bytes_.size()));
        }
        const Bytes taken = bytes_.subspan(position_, static_cast<std::size_t>(count));
        position_ += taken.size();
        return taken;
    }

    template <typename T>
    T read() {
        return load<T>(take(sizeof(T)));
    }

    std::string_view read_text() {
        const Bytes text = take(read<std::uint32_t>());
        return {reinterpret_cast<const char*>(text.data()), text.size()};
    }

    void charge_memory(std::uint64_t byte_count) {
        if (byte_count <= memory_left_) {
            memory_left_ -= byte_count;
            return;
        }
        throw core::InputError(core::ErrorKind::kOutOfMemory,
                               fmt::format("'{}': {}the grids ask for more than {} times the file's size",
                                           name_, element_, kMemoryPerFileByte));
    }

    /// Returns whether the entries say that values are stored as half.
    bool scan_metadata() {
        bool is_half = false;
        const auto count = read<std::uint32_t>();
        for (std::uint32_t i = 0; i < count; ++i) {
            const std::string_view entry = read_text();
            const std::string_view type = read_text();
            const Bytes value = take(read<std::uint32_t>());
            // Copies of it are kept in memory.
            charge_memory(256 + 2 * (entry.size() + type.size() + value.size()));
            const std::optional<std::size_t> size = fixed_size(kMetadataTypes, type);
            if (size && *size != value.size()) {
                fail(fmt::format("metadata '{}' of type {} has {} bytes; {} are right", entry, type,
                                 value.size(), *size));
            }
            if (type == "bool" && value[0] > 1) {
                fail(fmt::format("metadata '{}' is {}; 0 and 1 are bools", entry, value[0]));
            }
            if (type == "bool" && entry == "is_saved_as_half_float") is_half = value[0] != 0;
            if (type == "__delayedload") {
                check_leaf_table(entry, value);
            } else if (!size && type != "string") {
                fail(fmt::format("metadata '{}' has the type '{}', which is not known", entry, type));
            }
        }
        return is_half;
    }

    /// OpenVDB's list of the leaves' sizes: a count, then a byte and eight bytes a leaf, each list either as
    /// it is (0) or in so many bytes of Blosc; the second may be missing (2^32 - 1).
    void check_leaf_table(std::string_view entry, Bytes value) const {
        std::size_t position = 0;
        const auto next = [&](std::uint64_t count) {
            if (count > value.size() - position) {
                fail(fmt::format("metadata '{}' ends inside its list of leaves", entry));
            }
            const Bytes taken = value.subspan(position, static_cast<std::size_t>(count));
            position += taken.size();
            return taken;
        };
        if (value.empty()) return;
        const std::uint64_t leaf_count = load<std::uint32_t>(next(4));
        if (leaf_count > bytes_.size() / kLeafMaskBytes) {
            fail(fmt::format("metadata '{}' lists {} leaves, more than the file has", entry, leaf_count));
        }
        for (const std::uint64_t bytes_each : {1, 8}) {
            const auto compressed = load<std::uint32_t>(next(4));
            if (compressed == std::numeric_limits<std::uint32_t>::max() && bytes_each == 8) break;
            if (compressed == 0) {
                next(leaf_count * bytes_each);
            } else {
                // Short lists are filled up with zeros.
                check_blosc(next(compressed), std::max(leaf_count * bytes_each, kLeastListBytes));
            }
        }
        if (position != value.size()) {
            fail(fmt::format("metadata '{}' goes on after its list of leaves", entry));
        }
    }

    void scan_grid(bool has_offsets) {
        const std::string_view grid = read_text();
        element_ = fmt::format("grid '{}': ", grid);
        std::string_view type_name = read_text();
        const std::string_view instance_of = read_text();
        const auto begin = read<std::int64_t>();
        read<std::int64_t>();  // Where the buffers begin, which follow the topology anyway.
        const auto end = read<std::int64_t>();
        if (has_offsets) {
            // In order and apart, so that no byte is read for two grids.
            if (begin < static_cast<std::int64_t>(position_) || end < begin ||
                end > static_cast<std::int64_t>(bytes_.size())) {
                fail(
                    fmt::format("lies from byte {} to {}, which is not behind its header and inside the "
                                "file of {} bytes",
                                begin, end, bytes_.size()));
            }
            position_ = static_cast<std::size_t>(begin);
        }
        const bool has_half_name = type_name.ends_with(kHalfSuffix);
        if (has_half_name) type_name.remove_suffix(kHalfSuffix.size());
        const auto* type = std::find_if(std::begin(kTreeTypes), std::end(kTreeTypes),
                                        [&](const TreeType& t) { return t.name == type_name; });
        if (type == std::end(kTreeTypes)) {
            fail(
                fmt::format("has the type '{}'; trees 5_4_3 of bool, mask, int32, int64, float, double, "
                            "vec3i, vec3s and vec3d are read",
                            type_name));
        }
        tree_ = *type;
        compression_ = read<std::uint32_t>();
        if (compression_ > (kZip | kActiveMask | kBlosc)) {
            fail(fmt::format("has the unknown compression {}", compression_));
        }
        is_half_ = scan_metadata();
        if (has_half_name && !is_half_) fail("is of half floats by its type, but not by its metadata");
        scan_map();
        if (instance_of.empty()) scan_tree();
        if (!has_offsets) return;
        if (position_ > static_cast<std::size_t>(end)) fail(fmt::format("ends after its end, byte {}", end));
        position_ = static_cast<std::size_t>(end);
    }

    void scan_map() {
        const std::string_view map = read_text();
        if (map == "NonlinearFrustumMap") {
            take(48 + 8 + 8);  // Box, taper and depth; then an affine map.
            if (read_text() != "AffineMap") fail("has a frustum without an affine map");
            take(*fixed_size(kMaps, "AffineMap"));
            return;
        }
        const std::optional<std::size_t> size = fixed_size(kMaps, map);
        if (!size) fail(fmt::format("has the transform '{}', which is not known", map));
        take(*size);
    }

    void scan_tree() {
        if (read<std::int32_t>() != 1) fail("has more than one buffer a leaf; one is read");
        read_value();  // Background.
        const auto tile_count = read<std::uint32_t>();
        const auto child_count = read<std::uint32_t>();
        std::set<Coordinate> corners;
        for (std::uint32_t i = 0; i < tile_count; ++i) {
            read_corner(corners);
            read_value();
            if (const auto active = read<std::uint8_t>(); active > 1) {
                fail(fmt::format("tile {} has the state {}; 0 and 1 are known", i, active));
            }
        }
        leaves_.clear();
        for (std::uint32_t i = 0; i < child_count; ++i) scan_upper_node(read_corner(corners));
        for (const Leaf& leaf : leaves_) scan_leaf(leaf);
    }

    void read_value() {
        const Bytes value = take(tree_.value_bytes);
        if (tree_.leaf != LeafKind::kValues && value[0] > 1) {
            fail(fmt::format("a value is {}; 0 and 1 are bools", value[0]));
        }
    }

    Coordinate read_corner(std::set<Coordinate>& corners) {
        charge_memory(128);  // An entry of the root's table.
        const Coordinate corner{read<std::int32_t>(), read<std::int32_t>(), read<std::int32_t>()};
        for (const std::int32_t c : {corner.x, corner.y, corner.z}) {
            if (c % kUpperSide != 0 || c < -kFarthestTile || c > kFarthestTile) {
                fail(fmt::format("a node lies at {}; multiples of {} from {} to {} are right", c, kUpperSide,
                                 -kFarthestTile, kFarthestTile));
            }
        }
        if (!corners.insert(corner).second) {
            fail(fmt::format("two nodes lie at ({}, {}, {})", corner.x, corner.y, corner.z));
        }
        return corner;
    }

    void scan_upper_node(const Coordinate& corner) {
        const Bytes children = scan_inner_values(kUpperMaskBytes);
        const std::int32_t side = kUpperSide >> kUpperLog2;
        for (std::size_t i = 0; i < 8 * kUpperMaskBytes; ++i) {
            if (is_on(children, i)) scan_lower_node(child_corner(corner, i, kUpperLog2, side));
        }
    }

    void scan_lower_node(const Coordinate& corner) {
        const Bytes children = scan_inner_values(kLowerMaskBytes);
        for (std::size_t i = 0; i < 8 * kLowerMaskBytes; ++i) {
            if (!is_on(children, i)) continue;
            leaves_.push_back(
                {child_corner(corner, i, kLowerLog2, std::int32_t{1} << kLeafLog2), take(kLeafMaskBytes)});
            charge_memory(128 + 512 * tree_.value_bytes);
        }
    }

    /// The masks and values of an inner node. Returns the mask of its children.
    Bytes scan_inner_values(std::size_t mask_bytes) {
        // Values share their memory with pointers, and are read into a list of their own first.
        charge_memory(8 * mask_bytes * (std::max<std::size_t>(tree_.value_bytes, 8) + tree_.value_bytes));
        const Bytes children = take(mask_bytes);
        const Bytes active = take(mask_bytes);
        for (std::size_t i = 0; i < mask_bytes; ++i) {
            if (children[i] & active[i]) fail("a node's child is also marked as an active value");
        }
        scan_values(active);
        return children;
    }

    void scan_leaf(const Leaf& leaf) {
        const Bytes mask = take(kLeafMaskBytes);
        if (!std::equal(mask.begin(), mask.end(), leaf.mask.begin())) fail("a leaf has two different masks");
        if (tree_.leaf == LeafKind::kValues) {
            scan_values(mask);
            return;
        }
        const Coordinate corner{read<std::int32_t>(), read<std::int32_t>(), read<std::int32_t>()};
        if (corner != leaf.corner) {
            fail(fmt::format("a leaf at ({}, {}, {}) says that it lies at ({}, {}, {})", leaf.corner.x,
                             leaf.corner.y, leaf.corner.z, corner.x, corner.y, corner.z));
        }
        if (tree_.leaf == LeafKind::kBits) take(kLeafMaskBytes);
    }

    /// The values of a node with this mask of active ones.
    void scan_values(Bytes active) {
        // What is known of inactive values, so that they need not be stored: nothing, or one value (2, 4) or
        // two (5), or a mask that chooses between two (3 to 5); 6 stores all.
        constexpr std::uint8_t kStoresAll = 6;
        const auto inactive = read<std::uint8_t>();
        if (inactive > kStoresAll)
            fail(fmt::format("a node stores its values in the unknown way {}", inactive));
        if (inactive == 2 || inactive == 4 || inactive == 5) read_value();
        if (inactive == 5) read_value();
        if (inactive >= 3 && inactive <= 5) take(active.size());
        const bool only_active = (compression_ & kActiveMask) && inactive != kStoresAll;
        const std::size_t count = only_active ? count_bits(active) : 8 * active.size();
        const bool stored_as_half = is_half_ && tree_.half_bytes != tree_.value_bytes;
        // No halves are no chunk; none of another type are a chunk of size 0.
        if (stored_as_half && count == 0) return;
        scan_chunk(count * (stored_as_half ? tree_.half_bytes : tree_.value_bytes));
    }

    /// `byte_count` bytes as they are, or as a chunk of Blosc or Deflate with its size in front; not more
    /// than 0: not compressed after all.
    void scan_chunk(std::uint64_t byte_count) {
        if (!(compression_ & (kZip | kBlosc))) {
            take(byte_count);
            return;
        }
        const auto size = read<std::int64_t>();
        if (size > 0) {
            const Bytes chunk = take(static_cast<std::uint64_t>(size));
            if (compression_ & kBlosc) check_blosc(chunk, byte_count);
        } else if (const std::uint64_t plain = 0 - static_cast<std::uint64_t>(size); plain != byte_count) {
            fail(fmt::format("a chunk holds {} bytes; {} are right", plain, byte_count));
        } else {
            take(byte_count);
        }
    }

    /// A chunk's header must agree with where it lies: Blosc reads and writes as much as the header says.
    void check_blosc(Bytes chunk, std::uint64_t byte_count) const {
        if (chunk.size() < kBloscHeaderBytes) fail("a chunk ends inside its header");
        const std::uint64_t unpacked = load<std::uint32_t>(chunk.subspan(4));
        const std::uint64_t packed = load<std::uint32_t>(chunk.subspan(12));
        if (unpacked != byte_count || packed != chunk.size()) {
            fail(fmt::format("a chunk of {} bytes says that it unpacks {} bytes to {}; {} are wanted",
                             chunk.size(), packed, unpacked, byte_count));
        }
    }

    Bytes bytes_;
    const std::string& name_;
    std::uint64_t memory_left_;
    std::size_t position_ = 0;
    std::string element_;  ///< What messages begin with.
    TreeType tree_{};
    std::uint32_t compression_ = 0;
    bool is_half_ = false;
    std::vector<Leaf> leaves_;  ///< In the order of their buffers.
};

}  // namespace

void scan_vdb(std::span<const std::uint8_t> bytes, const std::string& name) {
    Scanner(bytes, name).scan();
}

}  // namespace sdf

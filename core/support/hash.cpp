#include "core/support/hash.h"

#include <fmt/format.h>
#include <xxhash.h>

namespace core {

struct Hasher::State {
    XXH3_state_t* stream = XXH3_createState();
    ~State() { XXH3_freeState(stream); }
};

Hasher::Hasher() : state_(std::make_unique<State>()) {
    XXH3_128bits_reset(state_->stream);
}
Hasher::~Hasher() = default;

void Hasher::add_bytes(const void* data, std::size_t size) {
    if (size > 0) XXH3_128bits_update(state_->stream, data, size);
}

std::string Hasher::hex() const {
    const XXH128_hash_t hash = XXH3_128bits_digest(state_->stream);
    return fmt::format("{:016x}{:016x}", hash.high64, hash.low64);
}

}  // namespace core

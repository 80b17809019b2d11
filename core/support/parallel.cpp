#include "core/support/parallel.h"

#include <tbb/blocked_range.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>
#include <xmmintrin.h>

#include <atomic>
#include <cassert>
#include <chrono>
#include <string>
#include <thread>

#if defined(__SANITIZE_THREAD__)
#include <algorithm>
#include <exception>
#include <mutex>
#include <utility>
#include <vector>
#endif

#include "core/support/memory.h"

namespace core {

namespace {

constexpr unsigned int kFlushToZeroAndDenormalsAreZero = 0x8040;

/// What a thread takes when it starts: its stack and what oneTBB and the C library keep for it.
constexpr std::size_t kBytesPerThread = std::size_t{9} << 20;

/// Starts all threads of this arena now. oneTBB starts them when work comes and ends the program where the
/// system refuses one, so under a limit on memory they must stand before memory runs out.
void start_threads(int thread_count) {
    require_memory(static_cast<std::uint64_t>(thread_count) * kBytesPerThread,
                   std::to_string(thread_count) + " threads (--threads)");
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(1);
    std::atomic<int> arrived{0};
    tbb::parallel_for(
        tbb::blocked_range<int>(0, thread_count, 1),
        [&](const tbb::blocked_range<int>&) {
            ++arrived;
            // Each thread holds one of the ranges until all are held, or none comes any more.
            while (arrived < thread_count && std::chrono::steady_clock::now() < deadline) {
                std::this_thread::yield();
            }
        },
        tbb::simple_partitioner());
}

}  // namespace

#if defined(__SANITIZE_THREAD__)

// oneTBB is not instrumented, so that ThreadSanitizer cannot see how it orders a loop's start and end. Its
// builds run loops on threads that it can follow; a loop within a loop runs on the thread that meets it.
void parallel_for(std::size_t count, std::size_t grain,
                  const std::function<void(std::size_t, std::size_t)>& body) {
    assert(grain > 0);
    static thread_local bool is_inside = false;
    std::atomic<std::size_t> next{0};
    std::mutex mutex;
    std::exception_ptr failure;
    const auto work = [&] {
        const bool was_inside = std::exchange(is_inside, true);
        try {
            for (std::size_t begin; (begin = next.fetch_add(grain)) < count;) {
                body(begin, std::min(count, begin + grain));
            }
        } catch (...) {
            const std::lock_guard lock(mutex);
            if (!failure) failure = std::current_exception();
        }
        is_inside = was_inside;
    };
    std::vector<std::thread> others(is_inside ? 0 : static_cast<std::size_t>(thread_limit() - 1));
    for (std::thread& other : others) other = std::thread(work);
    work();
    for (std::thread& other : others) other.join();
    if (failure) std::rethrow_exception(failure);
}

#else

void parallel_for(std::size_t count, std::size_t grain,
                  const std::function<void(std::size_t, std::size_t)>& body) {
    assert(grain > 0);
    if (count == 0) return;
    tbb::parallel_for(
        tbb::blocked_range<std::size_t>(0, count, grain),
        [&](const tbb::blocked_range<std::size_t>& range) { body(range.begin(), range.end()); },
        tbb::simple_partitioner());
}

#endif

void with_thread_limit(int thread_count, const std::function<void()>& work) {
    if (thread_count <= 0) {
        if (memory_is_limited()) start_threads(thread_limit());
        work();
        return;
    }
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                    static_cast<std::size_t>(thread_count));
    tbb::task_arena arena(thread_count);
    arena.execute([&] {
        if (memory_is_limited()) start_threads(thread_count);
        work();
    });
}

int thread_limit() {
    return tbb::this_task_arena::max_concurrency();
}

ScopedFlushDenormals::ScopedFlushDenormals() : previous_(_mm_getcsr()) {
    _mm_setcsr(previous_ | kFlushToZeroAndDenormalsAreZero);
}

ScopedFlushDenormals::~ScopedFlushDenormals() {
    _mm_setcsr(previous_);
}

}  // namespace core

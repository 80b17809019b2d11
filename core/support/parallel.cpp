#include "core/support/parallel.h"

#include <tbb/blocked_range.h>
#include <tbb/global_control.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>
#include <xmmintrin.h>

#include <cassert>

#if defined(__SANITIZE_THREAD__)
#include <sanitizer/tsan_interface.h>
#endif

namespace core {

namespace {

constexpr unsigned int kFlushToZeroAndDenormalsAreZero = 0x8040;

/// ThreadSanitizer cannot see how oneTBB, which is not instrumented, orders the start and the end of a loop.
/// This tells it; elsewhere it is nothing.
class LoopOrder {
public:
#if defined(__SANITIZE_THREAD__)
    LoopOrder() {
        __tsan_release(&start_);
    }
    ~LoopOrder() {
        __tsan_acquire(&end_);
    }
    void enter() {
        __tsan_acquire(&start_);
    }
    void leave() {
        __tsan_release(&end_);
    }

private:
    char start_ = 0;
    char end_ = 0;
#else
    void enter() {}
    void leave() {}
#endif
};

}  // namespace

void parallel_for(std::size_t count, std::size_t grain,
                  const std::function<void(std::size_t, std::size_t)>& body) {
    assert(grain > 0);
    if (count == 0) return;
    LoopOrder order;
    tbb::parallel_for(
        tbb::blocked_range<std::size_t>(0, count, grain),
        [&](const tbb::blocked_range<std::size_t>& range) {
            order.enter();
            body(range.begin(), range.end());
            order.leave();
        },
        tbb::simple_partitioner());
}

void with_thread_limit(int thread_count, const std::function<void()>& work) {
    if (thread_count <= 0) {
        work();
        return;
    }
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism,
                                    static_cast<std::size_t>(thread_count));
    tbb::task_arena arena(thread_count);
    arena.execute(work);
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

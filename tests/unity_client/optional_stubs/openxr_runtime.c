/* A runtime of OpenXR that keeps the samples it is given. Its structures are those that the specification prints. */
#include <stdint.h>
#include <string.h>

typedef struct { int32_t type; const void *next; uint64_t action, subaction_path; } ActionInfo;
typedef struct {
    int32_t type;
    const void *next;
    uint32_t buffer_size;
    const float *buffer;
    float sample_rate;
    uint32_t append;
    uint32_t *samples_consumed;
} PcmVibration;
typedef struct { int32_t type; void *next; float sample_rate; } PcmRate;

enum { INSTANCE = 7, SESSION = 9, ACTION = 11, RIGHT = 3, MOST = 4000, KEPT = 1 << 18 };

float rate_hz = 2000.0f, kept[KEPT];
int32_t count, appended, stops;

static int is_valid(uint64_t session, const ActionInfo *info) {
    return session == SESSION && info->type == 59 && !info->next && info->action == ACTION && info->subaction_path == RIGHT;
}

static int32_t get_rate(uint64_t session, const ActionInfo *info, PcmRate *rate) {
    if (!is_valid(session, info) || rate->type != 1000209002 || rate->next) return -1;
    rate->sample_rate = rate_hz;
    return 0;
}

static int32_t apply(uint64_t session, const ActionInfo *info, const PcmVibration *wave) {
    int is_wave = wave->type == 1000209001 && !wave->next && wave->sample_rate == rate_hz;
    if (!is_valid(session, info) || !is_wave || wave->buffer_size < 1 || wave->buffer_size > MOST || wave->append > 1) return -1;
    if (!count && wave->append) return -1;
    if (count + wave->buffer_size > KEPT) return -2;
    memcpy(kept + count, wave->buffer, wave->buffer_size * sizeof(float));
    count += wave->buffer_size;
    appended += wave->append;
    *wave->samples_consumed = wave->buffer_size;
    return 0;
}

static int32_t stop(uint64_t session, const ActionInfo *info) {
    if (!is_valid(session, info)) return -1;
    stops++;
    return 0;
}

int32_t get_function(uint64_t instance, const char *name, void **function) {
    *function = 0;
    if (instance != INSTANCE) return -1;
    if (!strcmp(name, "xrApplyHapticFeedback")) *function = (void *)apply;
    if (!strcmp(name, "xrStopHapticFeedback")) *function = (void *)stop;
    if (!strcmp(name, "xrGetDeviceSampleRateFB")) *function = (void *)get_rate;
    return *function ? 0 : -7; /* XR_ERROR_FUNCTION_UNSUPPORTED */
}

void *finder(void) { return (void *)get_function; }
void set_rate(float hz) { rate_hz = hz; }
float sample(int32_t at) { return kept[at]; }
int32_t counted(int32_t what) { return what == 0 ? count : what == 1 ? appended : stops; }

// Decodes and answers the messages of frames, and encodes telemetry.
#pragma once
#include "board.h"

namespace plate {

// Carries out the message in board.decoder and answers it.
void answer_frame(Board& board);

void send_telemetry(Board& board);

}  // namespace plate

using System;

namespace HapticVLM
{
    /// <summary>The parts of a message as they come in, put together; used again for the next one.</summary>
    internal sealed class ReceiveBuffer
    {
        const int LargestMessage = 8 * 1024 * 1024; // a service that says more is not ours

        byte[] bytes = new byte[16384];
        int length;

        /// <summary>Room for the next part; throws LinkException when the message is too large.</summary>
        public ArraySegment<byte> Free()
        {
            if (length == bytes.Length)
            {
                if (bytes.Length >= LargestMessage) throw new LinkException("a message exceeds 8 MiB");
                Array.Resize(ref bytes, bytes.Length * 2);
            }
            return new ArraySegment<byte>(bytes, length, bytes.Length - length);
        }

        public void Add(int count)
        {
            length += count;
        }

        /// <summary>The whole message; it lasts until the next part comes in.</summary>
        public ArraySegment<byte> Take()
        {
            var message = new ArraySegment<byte>(bytes, 0, length);
            length = 0;
            return message;
        }
    }
}

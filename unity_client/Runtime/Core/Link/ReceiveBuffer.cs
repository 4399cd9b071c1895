using System;

namespace HapticVLM
{
    /// <summary>Joins the received parts of a message in one buffer, which is reused for the next message.</summary>
    internal sealed class ReceiveBuffer
    {
        const int MaxMessageBytes = 8 * 1024 * 1024; // no message of the protocol is as large

        byte[] bytes = new byte[16384];
        int length;

        /// <summary>Returns free space for the next part; throws LinkException when the message is too large.</summary>
        public ArraySegment<byte> Free()
        {
            if (length == bytes.Length)
            {
                if (bytes.Length >= MaxMessageBytes) throw new LinkException("the service sent a message of more than 8 MiB");
                Array.Resize(ref bytes, bytes.Length * 2);
            }
            return new ArraySegment<byte>(bytes, length, bytes.Length - length);
        }

        public void Add(int count)
        {
            length += count;
        }

        /// <summary>Returns the whole message; it stays valid until the next part is added.</summary>
        public ArraySegment<byte> Take()
        {
            var message = new ArraySegment<byte>(bytes, 0, length);
            length = 0;
            return message;
        }
    }
}

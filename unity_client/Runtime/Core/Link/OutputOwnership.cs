using System.Threading;
using HapticVLM.Wire;

namespace HapticVLM
{
    /// <summary>
    /// Whether this connection owns the outputs of the service, and what it asks for to own them: one
    /// scene does, and only it is felt. Outputs that become free are taken at once. While another owns
    /// them, a hand that touches asks from time to time, as an owner that touches nothing gives way.
    /// </summary>
    public sealed class OutputOwnership
    {
        const double AskEveryS = 2.0;

        static int epochs;

        readonly object gate = new object();
        readonly bool isWanted;
        bool isOwner;
        bool isAsked;
        double askedAt = double.NegativeInfinity;
        int epoch;

        internal OutputOwnership(bool isWanted)
        {
            this.isWanted = isWanted;
        }

        public bool IsOwner { get { lock (gate) return isOwner; } }

        /// <summary>
        /// Changes whenever the service knows nothing of what a hand does: with every session, and when
        /// the outputs were taken. No two connections of this process share a value.
        /// </summary>
        public int Epoch { get { lock (gate) return epoch; } }

        internal void Restart(bool ownsFromTheStart)
        {
            lock (gate)
            {
                isOwner = ownsFromTheStart;
                isAsked = isOwner && !isWanted;
                askedAt = double.NegativeInfinity;
                epoch = Interlocked.Increment(ref epochs);
            }
        }

        /// <summary>The service says whose the outputs are.</summary>
        internal void Follow(bool isMine, bool isFree)
        {
            lock (gate)
            {
                isOwner = isMine;
                if (isFree && isWanted) isAsked = true;
            }
        }

        /// <summary>The service did what was asked.</summary>
        internal void Granted()
        {
            lock (gate)
            {
                isOwner = isWanted;
                epoch = Interlocked.Increment(ref epochs);
            }
        }

        /// <summary>A hand touches something and is not felt.</summary>
        internal void AskForTouch(double now)
        {
            lock (gate)
            {
                if (isOwner || !isWanted || now < askedAt + AskEveryS) return;
                askedAt = now;
                isAsked = true;
            }
        }

        /// <summary>What to ask the service for now; Other for nothing.</summary>
        internal SetOwnership Next()
        {
            lock (gate)
            {
                if (!isAsked) return SetOwnership.Other;
                isAsked = false;
                return isWanted ? SetOwnership.Take : SetOwnership.Give;
            }
        }
    }
}

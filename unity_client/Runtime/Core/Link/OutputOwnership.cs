using System.Threading;
using HapticVLM.Wire;

namespace HapticVLM
{
    /// <summary>
    /// Tracks whether this connection owns the outputs of the service, and requests them. One scene
    /// owns them at a time, and only that scene is felt. Free outputs are taken at once. While another
    /// scene owns them, a touching hand repeats the request, since an idle owner loses the outputs.
    /// </summary>
    public sealed class OutputOwnership
    {
        const double RequestIntervalS = 2.0;

        static int epochs;

        readonly object gate = new object();
        readonly bool isWanted;
        bool isOwner;
        bool isRequestPending;
        double requestedAt = double.NegativeInfinity;
        int epoch;

        internal OutputOwnership(bool isWanted)
        {
            this.isWanted = isWanted;
        }

        public bool IsOwner { get { lock (gate) return isOwner; } }

        /// <summary>
        /// Changes whenever the service has no state of the hands: with every session, and when the
        /// outputs are taken. No two connections of this process share a value.
        /// </summary>
        public int Epoch { get { lock (gate) return epoch; } }

        internal void Restart(bool isInitialOwner)
        {
            lock (gate)
            {
                isOwner = isInitialOwner;
                isRequestPending = isOwner && !isWanted;
                requestedAt = double.NegativeInfinity;
                epoch = Interlocked.Increment(ref epochs);
            }
        }

        /// <summary>Applies an ownership message of the service.</summary>
        internal void Follow(bool isMine, bool isFree)
        {
            lock (gate)
            {
                isOwner = isMine;
                if (isFree && isWanted) isRequestPending = true;
            }
        }

        /// <summary>Records that the service granted the request.</summary>
        internal void Granted()
        {
            lock (gate)
            {
                isOwner = isWanted;
                epoch = Interlocked.Increment(ref epochs);
            }
        }

        /// <summary>Requests the outputs for a touch that is not felt, at most once every two seconds.</summary>
        internal void RequestForTouch(double now)
        {
            lock (gate)
            {
                if (isOwner || !isWanted || now < requestedAt + RequestIntervalS) return;
                requestedAt = now;
                isRequestPending = true;
            }
        }

        /// <summary>Returns the next request to send; Other for none.</summary>
        internal SetOwnership Next()
        {
            lock (gate)
            {
                if (!isRequestPending) return SetOwnership.Other;
                isRequestPending = false;
                return isWanted ? SetOwnership.Take : SetOwnership.Give;
            }
        }
    }
}

using System;
using System.Threading;
using HapticVLM.Wire;

namespace HapticVLM
{
    /// <summary>
    /// The connection to the service. A thread of its own connects, sends the handshake and the scene,
    /// and reconnects when the link is lost, until Close. No call blocks. Pump raises events on the
    /// thread that calls it. The objects passed to events are reused for the next message.
    /// </summary>
    public sealed class HapticConnection
    {
        const int CloseTimeoutMs = 500;

        static int threads;
        static int sessions;

        readonly ConnectionSettings settings;
        readonly ManualResetEvent closing = new ManualResetEvent(false);
        readonly Dispatcher dispatcher = new Dispatcher();
        readonly Backoff backoff;
        volatile ConnectionLoop loop;
        volatile Link link;
        volatile Welcome welcome;
        volatile string lastError = "";
        volatile int state;
        volatile int openings;
        volatile int session;
        long touchesRefused;

        public readonly Outbox Outbox;

        public HapticConnection(ConnectionSettings settings)
        {
            this.settings = settings;
            Outbox = new Outbox(settings.WantsOutputs);
            backoff = new Backoff(settings.FirstRetryS, settings.LongestRetryS, GetHashCode() ^ Environment.TickCount);
        }

        /// <summary>Number of threads and receive loops of all connections that are still running.</summary>
        public static int Running { get { return Thread.VolatileRead(ref threads) + ConnectionLoop.Running; } }

        public LinkState State { get { return (LinkState)state; } }

        /// <summary>Number of times that a link was opened and welcomed.</summary>
        public int Openings { get { return openings; } }

        /// <summary>
        /// Number of the session, from 1. It changes with every welcome, and no two connections of this
        /// process share a number. In a new session the service knows no object and no picture.
        /// </summary>
        public int Session { get { return session; } }

        /// <summary>Whether this scene owns the outputs of the service and is felt; one scene does at a time.</summary>
        public bool IsOwner { get { return State == LinkState.Ready && Outbox.Ownership.IsOwner; } }

        /// <summary>Time of the service's last message, on Clock; negative infinity without a link.</summary>
        public double ReceivedAt
        {
            get
            {
                ConnectionLoop current = loop;
                return current == null ? double.NegativeInfinity : current.ReceivedAt;
            }
        }

        /// <summary>The reason why the last link ended or could not be opened; empty before the first failure.</summary>
        public string LastError { get { return lastError; } }

        /// <summary>The last welcome of the service; null before the first.</summary>
        public Welcome Welcome { get { return welcome; } }

        /// <summary>Touches dropped because there was no link or another scene owned the outputs.</summary>
        public long TouchesRefused { get { return Interlocked.Read(ref touchesRefused); } }

        /// <summary>Events of received messages, and counts of dropped ones.</summary>
        public Dispatcher Arrivals { get { return dispatcher; } }

        /// <summary>Starts to connect. Call it once.</summary>
        public void Open()
        {
            state = (int)LinkState.Connecting;
            Interlocked.Increment(ref threads);
            new Thread(Run) { IsBackground = true, Name = "hapticvlm" }.Start();
        }

        /// <summary>Closes the link and ends the thread. Returns at once; both happen on the other thread.</summary>
        public void Close()
        {
            closing.Set();
            Outbox.Wake();
        }

        /// <summary>Closes without a closing handshake, for the moment before all threads are killed.</summary>
        public void Abort()
        {
            Close();
            Link open = link;
            if (open != null) open.Abort();
        }

        /// <summary>Raises events of received messages for at most this many seconds. Call it on the main thread.</summary>
        public void Pump(double budgetS = 0.001)
        {
            dispatcher.Pump(State, IsOwner, budgetS);
        }

        /// <summary>
        /// Sends a touch, whose captured_at is a time of Clock. Returns false if there is no link or
        /// another scene owns the outputs; in the second case the outputs are requested. A touch is
        /// never stored for later, because a late one would be wrong. When the ring is full of contacts
        /// and releases the link counts as dead and is closed. Throws WireException for a touch without
        /// hand or phase.
        /// </summary>
        public bool Send(ref Touch touch)
        {
            if (touch.Hand == HandName.Other || touch.Phase == Phase.Other)
                throw new WireException("a touch has a hand, left or right, and a phase");
            ConnectionLoop current = loop;
            if (current == null || !Outbox.Ownership.IsOwner)
            {
                if (touch.Phase == Phase.Contact || touch.Phase == Phase.Slide) Outbox.Ownership.RequestForTouch(Clock.Now);
                Interlocked.Increment(ref touchesRefused);
                Flush();
                return false;
            }
            touch.ObjectId = WireText.Within(touch.ObjectId, Touch.ObjectIdMaxLength);
            bool isQueued = Outbox.Touches.Add(ref touch);
            if (!isQueued) current.Fail("the service does not accept touches fast enough");
            Flush();
            return isQueued;
        }

        /// <summary>
        /// Queues a frame in place of one not sent yet, and sets its id. Texture maps and all other frames have
        /// a queue each; one thread at a time may use either.
        /// </summary>
        public void Send(ref Frame frame)
        {
            FrameMailbox queue = frame.Purpose == FramePurpose.Texture ? Outbox.Maps : Outbox.Frames;
            frame.Id = Outbox.Ids.Next();
            frame.Write(queue.Begin());
            queue.Publish();
            Flush();
        }

        /// <summary>Stops the outputs. The message goes before all others.</summary>
        public void Stop(Scope scope)
        {
            Outbox.Stop(scope);
            Flush();
        }

        /// <summary>Sends the next message from this thread if it can, and wakes the sending thread for the rest.</summary>
        public void Flush()
        {
            ConnectionLoop current = loop;
            if (current != null) current.SendNow();
            Outbox.Wake();
        }

        void Run()
        {
            try
            {
                while (!closing.WaitOne(0))
                {
                    state = (int)LinkState.Connecting;
                    TryOnce();
                    state = (int)LinkState.Waiting;
                    closing.WaitOne((int)(backoff.Next() * 1000.0));
                }
            }
            finally
            {
                state = (int)LinkState.Closed;
                Interlocked.Decrement(ref threads);
            }
        }

        void TryOnce()
        {
            try
            {
                link = Link.To(settings.Url, settings.ConnectTimeoutMs, closing);
                RunLoop(new ConnectionLoop(link, settings, Outbox, dispatcher));
            }
            catch (LinkException error)
            {
                lastError = error.Message;
            }
            catch (Exception error)
            {
                // A bug of this package must not end this thread, nor the process, as an unhandled exception would.
                lastError = "internal error of the client: " + error.Message;
                dispatcher.Fail(error);
            }
            finally
            {
                loop = null;
                Link open = link;
                link = null;
                if (open != null && closing.WaitOne(0)) open.Close(CloseTimeoutMs);
                else if (open != null) open.Abort();
            }
        }

        void RunLoop(ConnectionLoop next)
        {
            welcome = next.Handshake(closing);
            Outbox.Restart(welcome);
            loop = next;
            session = Interlocked.Increment(ref sessions);
            state = (int)LinkState.Ready;
            openings++;
            backoff.Reset();
            next.SendUntilLost(closing);
        }
    }
}

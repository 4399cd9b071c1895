using System.Collections.Generic;
using HapticVLM.Wire;

namespace HapticVLM
{
    /// <summary>Chooses the next object and view to send, among the objects whose material is uncertain.</summary>
    internal sealed class ObjectScanner
    {
        public const double SureConfidence = 0.6; // from which no more views are needed

        readonly Dictionary<string, int> views = new Dictionary<string, int>();
        int session;
        int viewsEach;

        /// <summary>Whether the last call of Next found no object left to show.</summary>
        public bool IsDone { get; private set; }

        /// <summary>Restarts in a new session, in which the service knows no pictures.</summary>
        public void Follow(int nowSession, int nowViewsEach)
        {
            viewsEach = nowViewsEach;
            if (nowSession == session) return;
            session = nowSession;
            views.Clear();
            IsDone = false;
        }

        public bool Next(List<HapticObject> among, out HapticObject next, out int view)
        {
            for (int i = 0; i < among.Count; i++)
            {
                next = among[i];
                views.TryGetValue(next.ObjectId, out view);
                if (view >= viewsEach || IsSure(next, view)) continue;
                views[next.ObjectId] = view + 1;
                IsDone = false;
                return true;
            }
            next = null;
            view = 0;
            IsDone = true;
            return false;
        }

        /// <summary>The first view is always shown, to verify the decision made by name.</summary>
        static bool IsSure(HapticObject shown, int view)
        {
            if (shown.StatedMaterial != null) return true;
            return view > 0 && shown.Material != null && shown.Source != Rung.Unknown && shown.Confidence >= SureConfidence;
        }
    }
}
